# docker build -t sqslam . && docker run --rm -v "$PWD:/data" sqslam run /data/film.mp4 -o /data/out
FROM debian:bookworm-slim AS build
WORKDIR /src
COPY . .
RUN scripts/package.sh

FROM debian:bookworm-slim
COPY --from=build /src/build/release/sqslam_*.deb /tmp/
RUN apt-get update && apt-get install -y --no-install-recommends /tmp/sqslam_*.deb && rm -rf /tmp/*.deb /var/lib/apt/lists/*
WORKDIR /data
ENTRYPOINT ["sqslam"]
