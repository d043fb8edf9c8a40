// The bar of buttons, the list of objects, and what is known of the chosen one.

sq.layerNames = {objects: "Objects", uncertain: "Uncertain objects", points: "Points", cloud: "Dense cloud",
  path: "Camera path", keyframes: "Keyframes", truth: "Ground truth", grid: "Grid", labels: "Names"};

sq.buildPanel = (view) => {
  const {data, root} = view;
  view.box = root.querySelector(".sq-box");
  view.side = root.querySelector(".sq-side");
  const list = root.querySelector(".sq-list");
  root.querySelector(".sq-count").textContent = data.objects.length;
  const order = [...view.objects].sort((a, b) => a.data.uncertain - b.data.uncertain || a.data.name.localeCompare(b.data.name));
  for (const object of order) {
    const dot = sq.make("i");
    dot.style.background = dot.style.borderColor = object.data.color;
    const seen = sq.make("small", {textContent: object.data.uncertain ? "uncertain" : "seen " + object.data.seen + "×"});
    object.row = sq.make("button", {className: object.data.uncertain ? "sq-unsure" : "", onclick: () => sq.select(view, object.index, true)},
      dot, sq.make("span", {textContent: object.data.name}), seen);
    list.append(object.row);
  }
  sq.buildLayers(view);
  sq.buildSearch(view);
  root.addEventListener("click", (event) => {
    const button = event.target.closest("button");
    if (!button) return;
    const choice = button.closest(".sq-choice");
    if (choice) sq.choose(view, choice.dataset.choice, button.dataset.value);
    if (button.dataset.act in sq.acts) sq.acts[button.dataset.act](view);
  });
  root.querySelector('[data-act="ride"]').addEventListener("change", (event) => {
    view.state.ride = event.target.checked;
    if (view.state.ride) sq.standAt(view, sq.cameraAt(view, view.state.time));
  });
  root.addEventListener("keydown", (event) => {
    if (event.key === "Escape") sq.escape(view);
    if (event.key === "Tab" && !view.box.hidden) sq.keepFocus(view.box, event);
    if (!view.box.hidden && (event.key === "ArrowLeft" || event.key === "ArrowRight")) view.box.step(event.key === "ArrowLeft" ? -1 : 1);
  }, true);
  list.addEventListener("keydown", (event) => {
    const rows = [...list.children];
    const at = rows.indexOf(document.activeElement);
    const next = {ArrowDown: at + 1, ArrowUp: at - 1, Home: 0, End: rows.length - 1}[event.key];
    if (at < 0 || next === undefined) return;
    event.preventDefault();
    rows[Math.min(rows.length - 1, Math.max(0, next))].focus();
  });
  if (root.clientWidth < 760) sq.setFolded(view, true);
};

// Tab goes round within a dialog.
sq.keepFocus = (box, event) => {
  const inside = [...box.querySelectorAll("button")];
  const last = event.shiftKey ? inside[0] : inside[inside.length - 1];
  if (inside.length === 0 || (box.contains(document.activeElement) && document.activeElement !== last)) return;
  event.preventDefault();
  (event.shiftKey ? inside[inside.length - 1] : inside[0]).focus();
};

sq.buildLayers = (view) => {
  const there = {cloud: view.cloud, points: view.points, truth: view.data.truth.length > 0, keyframes: view.data.keyframes.length > 0,
    path: view.data.path.times.length > 1, uncertain: view.data.objects.some((object) => object.uncertain)};
  const box = view.root.querySelector(".sq-layers");
  for (const [name, text] of Object.entries(sq.layerNames)) {
    if (name in there && !there[name]) continue;
    const input = sq.make("input", {type: "checkbox", checked: view.state.layers[name]});
    input.addEventListener("change", () => {
      view.state.layers[name] = input.checked;
      view.tell("state");
      sq.applyTime(view);
      view.draw();
    });
    box.append(sq.make("label", {}, input, text));
  }
};

sq.acts = {
  home: (view) => sq.home(view),
  play: (view) => sq.play(view),
  fold: (view) => (view.state.selected >= 0 && view.root.clientWidth < 760 ? sq.select(view, -1) : sq.fold(view)),
  measure: (view) => sq.setMeasuring(view, !view.state.measuring),
  theme: (view) => sq.setTheme(view, view.state.theme === "dark" ? "light" : "dark"),
  full: (view) => sq.setFull(view, !sq.isFull(view)),
  save: (view) => sq.savePicture(view),
  copy: (view) => sq.copyCommand(view),
};

sq.isFull = (view) => document.fullscreenElement === view.root || view.root.classList.contains("sq-filling");

// The whole screen, or the whole page in browsers that have no full screen, as on phones.
sq.setFull = async (view, on) => {
  try {
    if (document.fullscreenElement) await document.exitFullscreen();
    else if (on) await view.root.requestFullscreen();
  } catch (error) {
    view.root.classList.toggle("sq-filling", on);
  }
  if (!on) view.root.classList.remove("sq-filling");
  view.tell("state");
};

sq.setFolded = (view, on) => {
  view.side.classList.toggle("sq-folded", on);
  view.side.querySelector(".sq-fold").setAttribute("aria-expanded", !on);
};

sq.fold = (view) => {
  sq.setFolded(view, !view.side.classList.contains("sq-folded"));
  sq.resize(view);
};

sq.escape = (view) => {
  if (!view.box.hidden) return sq.closePhoto(view);
  if (document.activeElement === view.searchBox && view.searchBox.value) return sq.search(view, (view.searchBox.value = ""));
  if (view.state.measuring) return sq.setMeasuring(view, false);
  if (view.root.classList.contains("sq-filling") && view.state.selected < 0) return sq.setFull(view, false);
  sq.select(view, -1);
};

sq.choose = (view, choice, value) => {
  if (choice === "motion") return sq.setMotion(view, value);
  view.state[choice] = value;
  view.tell("state");
  view.draw();
};

sq.select = (view, index, approach = false) => {
  view.state.selected = index;
  const object = view.objects[index];
  const detail = view.root.querySelector(".sq-detail");
  detail.hidden = !object;
  view.side.classList.toggle("sq-shown", !!object);
  if (object) {
    sq.setFolded(view, false);
    detail.replaceChildren(...sq.describe(view, object));
    object.row.scrollIntoView({block: "nearest"});
    if (approach) sq.approach(view, object);
  }
  view.tell("state");
  view.tell("select", index);
  view.draw();
};

// Heading, numbers and best views of an object.
sq.describe = (view, object) => {
  const {data} = object;
  const dot = sq.make("i");
  dot.style.background = data.color;
  const numbers = sq.make("dl");
  const add = (name, value) => numbers.append(sq.make("dt", {textContent: name}), sq.make("dd", {textContent: value}));
  if (data.label !== data.name) add("Class", data.label);
  const metric = view.data.metres > 0;
  const size = data.size.map((length) => (metric ? (100 * length * view.data.metres).toFixed(1) : length.toPrecision(3)));
  add("Size", size.join(" × ") + (metric ? " cm" : ""));
  add("Shape ε₁, ε₂", data.shape.map((e) => e.toFixed(2)).join(", "));
  add("Yaw", ((data.yaw * 180) / Math.PI).toFixed(0) + "°");
  add("Seen in", data.seen + " frames");
  add("First seen", sq.clock(data.first));
  add("Points", data.points);
  add("Score", data.score.toFixed(2));
  add("Reliability", data.reliability.toFixed(2) + (data.uncertain ? ", uncertain" : ""));
  for (const [relation, other] of data.relations ?? []) add(relation[0].toUpperCase() + relation.slice(1), other);
  if (data.iou !== undefined) add("3D IoU with the true object", data.iou.toFixed(2));
  const views = sq.make("div", {className: "sq-views"});
  for (const index of data.views) {
    if (view.data.keyframes[index].image < 0) continue;
    const photo = sq.makePhoto(view, index, object.index);
    const open = () => sq.openPhoto(view, index, object.index);
    views.append(sq.make("button", {className: "sq-open", onclick: open, title: "Keyframe " + view.data.keyframes[index].id}, photo));
  }
  return [sq.make("h2", {className: data.uncertain ? "sq-unsure" : ""}, dot, data.name + " " + data.id), numbers, views];
};

sq.setTheme = (view, theme) => {
  view.state.theme = theme;
  document.documentElement.dataset.theme = theme;
  const dark = theme === "dark";
  view.colors = {background: dark ? "#14171c" : "#ffffff", camera: dark ? "#9fb0c0" : "#5b6b7a", now: dark ? "#ff6b6b" : "#d1495b",
    truth: dark ? "#ff8fc7" : "#c2185b", grid: dark ? "#5a6470" : "#b4b9bf", accent: dark ? "#6cc0dc" : "#1f6f8b"};
  if (!view.path) return;
  view.renderer.setClearColor(view.colors.background);
  const paper = new THREE.Color(view.colors.background);
  view.shared.paper.value = 0.2126 * paper.r + 0.7152 * paper.g + 0.0722 * paper.b;
  for (const [drawn, name] of [[view.frusta, "camera"], [view.now, "now"]]) drawn.material.color.set(view.colors[name]);
  view.path.material.uniforms.color.value.set(view.colors.camera);
  for (const line of view.truth) line.material.uniforms.color.value.set(view.colors.truth);
  view.grid.material.uniforms.color.value.set(view.colors.grid);
  view.tell("state");
  view.draw();
};

sq.press = (button, on) => {
  button.classList.toggle("sq-on", on);
  button.setAttribute("aria-pressed", on);
};

// Brings buttons, rows and layers up to the state.
sq.showState = (view) => {
  const {state, root} = view;
  for (const choice of root.querySelectorAll(".sq-choice")) {
    for (const button of choice.children) sq.press(button, state[choice.dataset.choice] === button.dataset.value);
  }
  sq.press(root.querySelector('[data-act="measure"]'), state.measuring);
  root.querySelector('[data-act="full"]').setAttribute("aria-pressed", sq.isFull(view));
  const play = root.querySelector('[data-act="play"]');
  play.textContent = state.playing ? "❚❚" : "▶";
  play.setAttribute("aria-label", state.playing ? "Pause" : "Play the growth of the map");
  for (const object of view.objects) {
    sq.press(object.row, object.index === state.selected);
    object.row.classList.toggle("sq-later", state.time < view.end && object.data.first > state.time);
    sq.styleObject(view, object);
  }
  const {layers} = state;
  view.objectGroup.visible = layers.objects;
  if (view.points) view.points.visible = layers.points;
  if (view.cloud) view.cloud.visible = layers.cloud;
  view.frusta.visible = layers.keyframes;
  view.now.visible = layers.path;
  for (const line of view.truth) line.visible = layers.truth;
  view.grid.visible = layers.grid;
  view.outlines.plain.material.uniforms.width.value = state.look === "solid" ? 1.2 : 2.2;
};
