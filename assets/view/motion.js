// The eye: orbiting (OrbitControls), flying, smooth changes of place, riding along with the camera.

sq.buildMotion = (view) => {
  const {look} = view.data;
  view.eye = new THREE.PerspectiveCamera(look.angle, 1, 0.004 * look.radius, 60 * look.radius);
  view.eye.up.set(...look.up);
  view.controls = new THREE.OrbitControls(view.eye, view.canvas);
  Object.assign(view.controls, {enableDamping: true, dampingFactor: 0.12, enableKeys: false, screenSpacePanning: true,
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

sq.moveTo = (view, goal, smooth = true) => {
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
  view.hint(motion === "fly" ? "W A S D or arrows move, Q and E sink and rise, Shift is faster, drag looks around" : "");
  view.tell("state");
};

sq.flightKeys = {KeyW: [0, 0, -1], ArrowUp: [0, 0, -1], KeyS: [0, 0, 1], ArrowDown: [0, 0, 1], KeyA: [-1, 0, 0],
  ArrowLeft: [-1, 0, 0], KeyD: [1, 0, 0], ArrowRight: [1, 0, 0], KeyQ: [0, -1, 0], KeyE: [0, 1, 0]};

sq.listenToFlight = (view) => {
  const {keys} = view.flight;
  view.root.addEventListener("keydown", (event) => {
    if (event.target.tagName === "INPUT" || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.code === "Home") sq.home(view);
    if (!(event.code in sq.flightKeys)) return;
    event.preventDefault();
    sq.setMotion(view, "fly");
    keys.add(event.code);
    view.flight.fast = event.shiftKey;
    view.draw(true);
  });
  view.root.addEventListener("keyup", (event) => keys.delete(event.code));
  view.root.addEventListener("blur", () => keys.clear());
  view.canvas.addEventListener("pointerdown", (event) => (view.flight.turn = [event.clientX, event.clientY]));
  window.addEventListener("pointerup", () => (view.flight.turn = null));
  window.addEventListener("pointermove", (event) => {
    const turn = view.flight.turn;
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
