// The view as a file, and as the command that draws it.

// Draws the names over the picture, as the page shows them.
sq.drawNames = (view, pen) => {
  const box = view.canvas.getBoundingClientRect();
  const style = getComputedStyle(view.root);
  const ink = (name) => style.getPropertyValue(name).trim();
  pen.textBaseline = "middle";
  for (const label of view.labelBox.children) {
    if (label.style.visibility !== "visible") continue;
    const at = label.getBoundingClientRect();
    const [x, y] = [at.left - box.left, at.top - box.top];
    const length = label.classList.contains("sq-length");
    pen.globalAlpha = label.classList.contains("sq-unsure") ? 0.65 : 1;
    pen.fillStyle = ink(length ? "--accent" : "--veil");
    pen.fillRect(x, y, at.width, at.height);
    const dot = label.querySelector("i");
    if (dot) {
      pen.fillStyle = dot.style.background;
      pen.fillRect(x + 6, y + at.height / 2 - 4.5, 9, 9);
    }
    pen.fillStyle = ink(length ? "--paper" : "--ink");
    pen.font = getComputedStyle(label).font;
    pen.fillText(label.textContent, x + (dot ? 21 : 6), y + at.height / 2);
  }
  pen.globalAlpha = 1;
};

// A canvas with the map and its names, without the buttons.
sq.picture = (view) => {
  view.drawNow();  // the browser forgets what was drawn before
  const picture = sq.make("canvas", {width: view.canvas.width, height: view.canvas.height});
  const pen = picture.getContext("2d");
  pen.drawImage(view.canvas, 0, 0);
  pen.scale(view.ratio, view.ratio);
  sq.drawNames(view, pen);
  return picture;
};

sq.savePicture = (view) =>
  sq.picture(view).toBlob((blob) => {
    const link = sq.make("a", {href: URL.createObjectURL(blob), download: (document.title || "map").replace(/[^\w.-]+/g, "-") + ".png"});
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  });

sq.quote = (word) => (/^[\w@%+=:,./-]+$/.test(word) ? word : "'" + word.replaceAll("'", "'\\''") + "'");

// The frame of the last keyframe shown, or nothing for the whole run.
sq.frameShown = (view) => {
  const shown = sq.keyframesShown(view);
  return view.state.time >= view.end || shown === 0 ? [] : ["--at-frame=" + view.data.keyframes[shown - 1].frame];
};

// `sqslam render` draws the part that the list leaves free, as the middle of the picture lies there.
sq.commandOf = (view) => {
  const {state, eye, data} = view;
  const {layers} = state;
  const numbers = (place) => place.toArray().map((x) => +x.toPrecision(7)).join(",");
  const height = view.canvas.clientHeight;
  const set = (name, value) => `--set=${name}=${value}`;
  const ahead = state.motion === "orbit" ? view.controls.target
    : eye.getWorldDirection(new THREE.Vector3()).multiplyScalar(data.look.radius).add(eye.position);
  return [...data.command, "--output=map.png", `--resolution=${Math.round(view.free * height)},${height}`,
    ...sq.frameShown(view), ...(state.theme === "dark" && !data.command.some((word) => word.startsWith("--style")) ? ["--style=dark"] : []),
    `--camera-position=${numbers(eye.position)}`, `--camera-focal-point=${numbers(ahead)}`, `--camera-view-up=${numbers(eye.up)}`,
    `--camera-view-angle=${+eye.fov.toFixed(4)}`,
    set("objects.look", state.look === "solid" ? "auto" : state.look), set("objects.show", layers.objects), set("objects.labels", layers.labels),
    ...(layers.uncertain ? [] : [set("objects.uncertain", "hide")]), set("points.show", layers.points),
    ...(view.cloud ? [set("dense_cloud.show", layers.cloud), ...(layers.points ? [set("dense_cloud.points", true)] : [])] : []),
    set("cameras.trajectory", layers.path), set("cameras.current", layers.path), set("cameras.keyframes", layers.keyframes),
    ...(data.truth.length > 0 ? [set("ground_truth.show", layers.truth)] : []), set("grid.show", layers.grid)].map(sq.quote).join(" ");
};

sq.copyCommand = async (view) => {
  const command = sq.commandOf(view);
  try {
    await navigator.clipboard.writeText(command);
    view.hint("Copied: " + command.slice(0, 60) + "…");
  } catch (error) {  // pages from the disk may not be allowed to
    const area = sq.make("textarea", {value: command, readOnly: true});
    view.root.append(area);
    area.select();
    const done = document.execCommand("copy");
    area.remove();
    view.hint(done ? "Copied: " + command.slice(0, 60) + "…" : command);
  }
  setTimeout(() => view.hint(""), 4000);
};
