// The eye: orbiting (OrbitControls), flying, smooth changes of place, riding along with the camera.

sq.buildMotion = (view) => {
  const {look} = view.data;
  view.eye = new THREE.PerspectiveCamera(look.angle, 1, 0.004 * look.radius, 60 * look.radius);
  view.eye.up.set(...look.up);
  view.controls = new THREE.OrbitControls(view.eye, view.canvas);
  Object.assign(view.controls, {enableDamping: !sq.reducedMotion(), dampingFactor: 0.12, enableKeys: false, screenSpacePanning: true,
    rotateSpeed: 0.8, zoomSpeed: 0.9, minDistance: 0.02 * look.radius, maxDistance: 20 * look.radius});
  view.controls.addEventListener("change", () => view.draw(true));
  view.flight = {keys: new Set(), turn: null};
  sq.listenToFlight(view);
};

// The first look of the pictures, moved back where the page is narrower than they are.
sq.home = (view, smooth = true) => {
  const {look} = view.data;
  const at = new THREE.Vector3(...look.at);
  const eye = new THREE.Vector3(...look.eye);
  const narrow = Math.max(1, 1.5 / view.free);
  eye.sub(at).multiplyScalar(narrow).add(at);
  sq.moveTo(view, {eye, at, angle: look.angle}, smooth);
};

sq.reducedMotion = () => matchMedia("(prefers-reduced-motion: reduce)").matches;

sq.moveTo = (view, goal, wish = true) => {
  const smooth = wish && !sq.reducedMotion();
  sq.setMotion(view, "orbit");
  const from = {eye: view.eye.position.clone(), at: view.controls.target.clone(), angle: view.eye.fov};
  const to = {angle: from.angle, ...goal};
  const begin = performance.now();
  view.move = (now) => {
    const share = smooth ? Math.min(1, (now - begin) / 600) : 1;
    const eased = share * share * (3 - 2 * share);
    view.eye.position.lerpVectors(from.eye, to.eye, eased);
    view.controls.target.lerpVectors(from.at, to.at, eased);
    view.eye.fov = from.angle + (to.angle - from.angle) * eased;
    view.eye.updateProjectionMatrix();
    if (share === 1) view.move = null;
  };
  if (!smooth) view.move(begin);
  view.draw(true);
};

// The object in the middle, as large as the scene allows, seen from where the eye is.
sq.approach = (view, object) => {
  const reach = Math.hypot(...object.data.size);
  const direction = view.eye.position.clone().sub(object.center).normalize();
  const distance = Math.max(2.6 * reach, 0.35 * view.data.look.radius);
  if (view.eye.position.distanceTo(object.center) < 1.3 * distance) return;
  sq.moveTo(view, {eye: direction.multiplyScalar(distance).add(object.center), at: object.center.clone(), angle: view.data.look.angle});
};

// The eye where a camera was, its picture filling the height.
sq.standAt = (view, pose, smooth = true) => {
  const {lens, look} = view.data;
  const ahead = new THREE.Vector3(0, 0, 0.6 * look.radius).applyQuaternion(pose.rotation).add(pose.position);
  const angle = (2 * 180 / Math.PI) * Math.atan(lens.height / 2 / lens.fy);
  sq.moveTo(view, {eye: pose.position, at: ahead, angle: Math.min(100, angle)}, smooth);
};

sq.setMotion = (view, motion) => {
  if (view.state.motion === motion) return;
  view.state.motion = motion;
  view.controls.enabled = motion === "orbit";
  if (motion === "orbit") {  // goes on about what is ahead
    const distance = view.eye.position.distanceTo(view.controls.target);
    const ahead = view.eye.getWorldDirection(new THREE.Vector3());
    view.controls.target.copy(view.eye.position).addScaledVector(ahead, distance);
  }
  const fly = motion === "fly";
  const touch = fly && matchMedia("(any-pointer: coarse)").matches;
  view.root.classList.toggle("sq-flying", fly);
  view.root.querySelector(".sq-pad").hidden = !touch;
  view.hint(!fly ? "" : touch ? "Drag looks around, hold the arrows to move"
    : "W A S D or arrows move, Q and E sink and rise, Shift is faster, drag looks around");
  view.flight.keys.clear();
  view.tell("state");
};

sq.flightKeys = {KeyW: [0, 0, -1], ArrowUp: [0, 0, -1], KeyS: [0, 0, 1], ArrowDown: [0, 0, 1], KeyA: [-1, 0, 0],
  ArrowLeft: [-1, 0, 0], KeyD: [1, 0, 0], ArrowRight: [1, 0, 0], KeyQ: [0, -1, 0], KeyE: [0, 1, 0]};

// Turns about the middle by degrees, right and up, and zooms by a factor, as dragging and the wheel do.
sq.turnBy = (view, right, up, zoom) => {
  const at = view.controls.target;
  const away = new THREE.Spherical();
  const level = new THREE.Quaternion().setFromUnitVectors(view.eye.up.clone().normalize(), new THREE.Vector3(0, 1, 0));
  away.setFromVector3(view.eye.position.clone().sub(at).applyQuaternion(level));
  away.theta -= (right * Math.PI) / 180;
  away.phi = Math.min(Math.PI - 0.02, Math.max(0.02, away.phi - (up * Math.PI) / 180));
  away.radius = Math.min(view.controls.maxDistance, Math.max(view.controls.minDistance, away.radius * zoom));
  const eye = new THREE.Vector3().setFromSpherical(away).applyQuaternion(level.inverse()).add(at);
  sq.moveTo(view, {eye, at: at.clone()}, false);
};

sq.turnKeys = {ArrowLeft: [-6, 0, 1], ArrowRight: [6, 0, 1], ArrowUp: [0, 6, 1], ArrowDown: [0, -6, 1], "+": [0, 0, 0.9],
  "=": [0, 0, 0.9], "-": [0, 0, 1.1]};

// Keys reach the map only where it has the focus: lists and buttons have their own.
sq.listenToFlight = (view) => {
  const {keys} = view.flight;
  view.canvas.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.code === "Home") sq.home(view);
    const turn = view.state.motion === "orbit" && sq.turnKeys[event.key];
    if (!turn && !(event.code in sq.flightKeys)) return;
    event.preventDefault();
    if (turn) return sq.turnBy(view, ...turn);
    sq.setMotion(view, "fly");
    keys.add(event.code);
    view.flight.fast = event.shiftKey;
    view.draw(true);
  });
  view.canvas.addEventListener("keyup", (event) => keys.delete(event.code));
  view.canvas.addEventListener("blur", () => keys.clear());
  for (const button of view.root.querySelectorAll("[data-fly]")) {  // held as a key is
    const release = () => keys.delete(button.dataset.fly);
    button.addEventListener("pointerdown", (event) => {
      event.preventDefault();
      keys.add(button.dataset.fly);
      view.draw(true);
    });
    for (const end of ["pointerup", "pointercancel", "pointerleave"]) button.addEventListener(end, release);
    button.addEventListener("click", (event) => {  // from a keyboard: one step
      if (event.detail !== 0) return;
      keys.add(button.dataset.fly);
      view.draw(true);
      setTimeout(release, 150);
    });
  }
  view.canvas.addEventListener("pointerdown", (event) => (view.flight.turn = event.isPrimary ? [event.clientX, event.clientY] : null));
  for (const end of ["pointerup", "pointercancel"]) window.addEventListener(end, () => (view.flight.turn = null));
  window.addEventListener("pointermove", (event) => {
    const turn = event.isPrimary && view.flight.turn;
    if (!turn || view.state.motion !== "fly") return;
    const scale = (view.eye.fov * Math.PI) / 180 / view.canvas.clientHeight;
    const right = new THREE.Vector3(1, 0, 0).applyQuaternion(view.eye.quaternion);
    view.eye.rotateOnWorldAxis(view.eye.up, (event.clientX - turn[0]) * scale);
    view.eye.rotateOnWorldAxis(right, (event.clientY - turn[1]) * scale);
    view.flight.turn = [event.clientX, event.clientY];
    view.draw(true);
  });
};

// Moves the eye for one frame. True while it is going on.
sq.step = (view, now, seconds) => {
  if (view.move) {
    view.move(now);
    view.controls.update();
    return true;
  }
  if (view.state.motion === "orbit") return view.controls.update();
  const step = new THREE.Vector3();
  for (const key of view.flight.keys) step.add(new THREE.Vector3(...sq.flightKeys[key]));
  if (step.lengthSq() === 0) return false;
  const speed = 0.6 * view.data.look.radius * (view.flight.fast ? 3 : 1);
  view.eye.position.add(step.multiplyScalar(speed * Math.min(0.1, seconds)).applyQuaternion(view.eye.quaternion));
  return true;
};
