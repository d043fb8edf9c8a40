// The camera's path, its keyframes, where it is at the time shown, and its true path.

// Places of a path without those that are hardly apart, and for each that is kept its number.
sq.simplerPath = (places, least) => {
  const kept = [];
  const numbers = [];
  for (let i = 0; i < places.length; i += 3) {
    const k = kept.length - 3;
    const step = k < 0 ? Infinity : Math.hypot(places[i] - kept[k], places[i + 1] - kept[k + 1], places[i + 2] - kept[k + 2]);
    if (step < least && i + 3 < places.length) continue;
    kept.push(places[i], places[i + 1], places[i + 2]);
    numbers.push(i / 3);
  }
  return {places: kept, numbers};
};

sq.frustum = (lens, pose, size) => {
  const corner = (x, y) =>
    new THREE.Vector3((size * (x - lens.cx)) / lens.fx, (size * (y - lens.cy)) / lens.fy, size)
      .applyQuaternion(pose.rotation)
      .add(pose.position);
  const w = lens.width - 0.5;
  const h = lens.height - 0.5;
  return [corner(-0.5, -0.5), corner(w, -0.5), corner(w, h), corner(-0.5, h)];
};

sq.frustumLines = (lens, pose, size) => {
  const corners = sq.frustum(lens, pose, size);
  return corners.flatMap((corner, i) => [pose.position, corner, corner, corners[(i + 1) % 4]]);
};

sq.buildCameras = (view) => {
  const {data} = view;
  const {times, poses} = data.path;
  const least = 0.006 * data.look.radius;
  const path = sq.simplerPath(times.flatMap((_, i) => poses.slice(7 * i, 7 * i + 3)), least);
  view.path = sq.makeLine(view, path.places, 1.7);
  view.pathTimes = path.numbers.map((i) => times[i]);
  view.truth = data.truth.map((piece) => sq.makeLine(view, sq.simplerPath(piece, least).places, 1.7));
  const size = 1.5 * data.lens.size;
  view.frusta = new THREE.LineSegments(
    new THREE.BufferGeometry().setFromPoints(
      data.keyframes.flatMap((keyframe) => sq.frustumLines(data.lens, sq.poseAt(keyframe.pose), size))),
    new THREE.LineBasicMaterial({color: view.colors.camera, transparent: true, opacity: 0.45}));
  view.now = new THREE.LineSegments(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({color: view.colors.now}));
  view.photo = new THREE.Mesh(new THREE.BufferGeometry(), new THREE.MeshBasicMaterial({side: THREE.DoubleSide, transparent: true, opacity: 0.95}));
  view.photo.visible = false;
  for (const drawn of [view.frusta, view.now, view.photo]) {
    drawn.frustumCulled = false;
    view.scene.add(drawn);
  }
};

// The pose of the camera at a time, between those of the path.
sq.cameraAt = (view, time) => {
  const {times, poses} = view.data.path;
  if (times.length === 0) return null;
  const next = Math.min(times.length - 1, sq.countUpTo(times, time));
  const before = Math.max(0, next - 1);
  const from = sq.poseAt(poses, 7 * before);
  const to = sq.poseAt(poses, 7 * next);
  const span = times[next] - times[before];
  const share = span > 0 ? Math.min(1, Math.max(0, (time - times[before]) / span)) : 1;
  return {position: from.position.lerp(to.position, share), rotation: from.rotation.slerp(to.rotation, share)};
};

sq.showCameraNow = (view) => {
  const pose = sq.cameraAt(view, view.state.time);
  if (!pose) return;
  view.now.geometry.dispose();
  view.now.geometry = new THREE.BufferGeometry().setFromPoints(
    sq.frustumLines(view.data.lens, pose, 2.2 * view.data.lens.size));
};

// Hangs a keyframe's image where it was taken.
sq.hangPhoto = (view, index) => {
  view.photo.visible = false;
  const keyframe = view.data.keyframes[index];
  if (!keyframe || keyframe.image < 0) return;
  const [a, b, c, d] = sq.frustum(view.data.lens, sq.poseAt(keyframe.pose), 6 * view.data.lens.size);
  const geometry = new THREE.BufferGeometry().setFromPoints([a, d, b, b, d, c]);
  geometry.setAttribute("uv", new THREE.Float32BufferAttribute([0, 1, 0, 0, 1, 1, 1, 1, 0, 0, 1, 0], 2));
  view.photo.geometry.dispose();
  view.photo.geometry = geometry;
  new THREE.TextureLoader().load(view.images[keyframe.image], (texture) => {
    texture.minFilter = THREE.LinearFilter;
    texture.generateMipmaps = false;
    if (view.photo.material.map) view.photo.material.map.dispose();
    view.photo.material.map = texture;
    view.photo.material.needsUpdate = true;
    view.photo.visible = view.state.keyframe === index;
    view.draw();
  });
};

// The keyframe whose camera is drawn nearest to a place of the canvas, in pixels, or -1.
sq.keyframeAt = (view, x, y) => {
  let best = -1;
  let nearest = 15;
  if (!view.frusta.visible) return best;
  const shown = sq.keyframesShown(view);
  for (let i = 0; i < shown; ++i) {
    const pose = sq.poseAt(view.data.keyframes[i].pose);
    const middle = new THREE.Vector3(0, 0, view.data.lens.size).applyQuaternion(pose.rotation).add(pose.position);
    for (const place of [pose.position, middle]) {
      const seen = view.project(place);
      const distance = Math.hypot(seen.x - x, seen.y - y);
      if (seen.z < 1 && distance < nearest) {
        nearest = distance;
        best = i;
      }
    }
  }
  return best;
};

sq.keyframesShown = (view) => sq.countUpTo(view.keyframeTimes, view.state.time);
