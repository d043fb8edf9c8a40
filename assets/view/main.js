// Puts the view together and draws it whenever something has changed.

sq.makeView = (root, loaded) => {
  const view = {
    root,
    canvas: root.querySelector(".sq-canvas"),
    data: loaded.scene,
    gltf: loaded.gltf,
    images: loaded.images,
    alone: document.documentElement.classList.contains("sq-alone"),
    ratio: 1,  // pixels of the canvas for one of the page
    frames: 0,
    state: {motion: "orbit", look: "solid", selected: -1, pointed: -1, answers: null, keyframe: -1, measuring: false, playing: false, ride: false, time: 0,
      theme: "light", layers: {objects: true, uncertain: true, points: true, cloud: true, path: true, keyframes: true, truth: true, grid: true, labels: true}},
  };
  const listeners = {state: [], select: []};
  view.listen = (name, act) => listeners[name].push(act);
  view.tell = (name, value) => listeners[name].forEach((act) => act(value));
  view.hint = (text) => (root.querySelector(".sq-hint").textContent = text);
  view.project = (place) => {
    const seen = place.clone().project(view.eye);
    return {x: ((seen.x + 1) / 2) * view.canvas.clientWidth, y: ((1 - seen.y) / 2) * view.canvas.clientHeight, z: seen.z};
  };
  return view;
};

sq.build = (view) => {
  view.renderer = new THREE.WebGLRenderer({canvas: view.canvas, antialias: true, powerPreference: "high-performance"});
  view.renderer.sortObjects = true;
  view.shared = sq.sharedUniforms(new THREE.Vector3(...view.data.look.up));
  const wish = document.documentElement.dataset.theme;
  sq.setTheme(view, wish || (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light"));
  sq.buildScene(view);
  if (view.cloud) {  // as in the pictures: what is in the glass can be seen, and its points need no others
    view.state.look = "glass";
    view.state.layers.points = false;
  }
  view.objectGroup = view.map.getObjectByName("objects") || new THREE.Group();
  sq.buildOutlines(view);
  sq.buildCameras(view);
  view.drawLoop = sq.makeLoop(view);
  view.draw = view.drawLoop.ask;
  view.drawNow = () => sq.drawNow(view);
  sq.buildMotion(view);
  sq.buildLabels(view);
  sq.buildTimeline(view);
  sq.buildPanel(view);
  sq.buildMeasure(view);
  document.addEventListener("fullscreenchange", () => view.tell("state"));
  view.listen("state", () => {
    sq.showState(view);
    sq.drawTimeline(view);
  });
  sq.resize(view);
  new ResizeObserver(() => sq.resize(view)).observe(view.root);
  sq.home(view, false);
  sq.applyTime(view);
  sq.setTheme(view, view.state.theme);
  sq.listenToPointer(view);
};

sq.resize = (view, detail = 1) => {
  const {clientWidth: width, clientHeight: height} = view.root;
  view.ratio = Math.min(2, window.devicePixelRatio || 1) * detail;
  view.renderer.setPixelRatio(view.ratio);
  view.renderer.setSize(width, height, false);
  view.eye.aspect = width / Math.max(1, height);
  // The middle of the picture is that of the part which the list leaves free.
  const list = width >= 760 && !view.side.classList.contains("sq-folded") ? view.side.offsetWidth + 12 : 0;
  view.free = (width - list) / Math.max(1, height);
  view.eye.setViewOffset(width, height, list / 2, 0, width, height);
  view.shared.canvas.value.set(width, height);
  for (const [points, size] of [[view.points, 2.4], [view.cloud, 1.5]]) {
    if (points) points.material.uniforms.size.value = size * view.ratio;
  }
  view.tell("state");
  view.draw();
};

sq.drawNow = (view) => {
  view.shared.pixelsAtOne.value =
    (view.canvas.clientHeight * view.ratio) / (2 * Math.tan((view.eye.fov * Math.PI) / 360));
  sq.drawOutlines(view);
  view.renderer.render(view.scene, view.eye);
  sq.drawLabels(view);
  sq.drawMeasure(view);
  ++view.frames;
};

// Draws at most once a frame of the screen. While the eye moves and frames take long, it draws fewer pixels.
sq.makeLoop = (view) => {
  let asked = false;
  let moving = false;
  let last = 0;
  let slow = 0;
  let detail = 1;
  let rest = 0;
  let known = false;  // that this machine is too slow for all of it
  const setDetail = (wanted) => {
    if (wanted === detail) return;
    detail = wanted;
    sq.setCoarse(view, detail < 1);
    sq.resize(view, detail);
  };
  const frame = (now) => {
    asked = false;
    const seconds = last > 0 ? (now - last) / 1000 : 0.016;
    last = now;
    sq.playStep(view, seconds);
    const going = sq.step(view, now, seconds) || view.state.playing;
    if (going && moving) {
      slow = 0.8 * slow + 0.2 * seconds;
      known = known || slow > 0.045;
      if (known && detail === 1) setDetail(0.7);
    }
    moving = going;
    clearTimeout(rest);
    if (going) {
      ask();
    } else {
      last = 0;
      slow = 0;
      if (detail < 1) rest = setTimeout(() => setDetail(1), 160);
    }
    view.drawNow();
  };
  const ask = () => {
    if (!asked) requestAnimationFrame(frame);
    asked = true;
  };
  return {ask};
};

sq.listenToPointer = (view) => {
  const {canvas} = view;
  let down = null;
  const place = (event) => {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  // In a longer page the wheel scrolls until the view is chosen by a click.
  const setActive = (on) => {
    view.controls.enableZoom = on || view.alone;
    view.controls.enabled = view.state.motion === "orbit" && (on || view.alone || matchMedia("(pointer: fine)").matches);
  };
  setActive(false);
  view.root.addEventListener("focusin", () => setActive(true));
  view.root.addEventListener("focusout", (event) => setActive(view.root.contains(event.relatedTarget)));
  canvas.addEventListener("pointerdown", (event) => {
    down = place(event);
    view.canvas.focus({preventScroll: true});
    for (const menu of view.root.querySelectorAll(".sq-menu")) menu.open = false;
  });
  canvas.addEventListener("pointerup", (event) => {
    const at = place(event);
    if (down && event.button === 0 && Math.hypot(at[0] - down[0], at[1] - down[1]) < 5) sq.click(view, ...at);
    down = null;
  });
  canvas.addEventListener("pointermove", (event) => {
    if (event.buttons !== 0 || event.pointerType === "touch") return;
    const hit = sq.objectAt(view, ...place(event));
    const pointed = hit ? hit.object.index : -1;
    view.root.classList.toggle("sq-pointing", hit !== null || sq.keyframeAt(view, ...place(event)) >= 0);
    if (pointed === view.state.pointed) return;
    view.state.pointed = pointed;
    view.tell("state");
    view.draw();
  });
};

sq.click = (view, x, y) => {
  if (view.state.measuring) return sq.measureClick(view, x, y);
  const hit = sq.objectAt(view, x, y);
  const keyframe = hit ? -1 : sq.keyframeAt(view, x, y);
  sq.select(view, hit ? hit.object.index : -1);
  sq.selectKeyframe(view, keyframe);
};

(async () => {
  const root = sq.element("sq");
  const wait = root.querySelector(".sq-wait");
  try {
    sq.view = sq.makeView(root, await sq.load());
    sq.build(sq.view);
    wait.remove();
    requestAnimationFrame(() => setTimeout(() => (root.dataset.ready = Math.round(performance.now()))));
  } catch (error) {
    wait.textContent = "The map cannot be shown: " + error.message;
    root.dataset.failed = error.message;
  }
})();
