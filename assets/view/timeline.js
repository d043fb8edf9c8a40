// The time slider: the map as it was known until then.

sq.buildTimeline = (view) => {
  const {data} = view;
  view.keyframeTimes = data.keyframes.map((keyframe) => keyframe.time);
  const last = Math.max(0, ...data.path.times, ...view.keyframeTimes);
  view.end = last;
  view.state.time = last;
  view.slider = view.root.querySelector(".sq-track input");
  view.clockText = view.root.querySelector(".sq-clock");
  view.slider.addEventListener("input", () => {
    view.state.playing = false;
    sq.setTime(view, (view.end * view.slider.value) / view.slider.max);
  });
};

sq.play = (view) => {
  view.state.playing = !view.state.playing;
  if (view.state.playing && view.state.time >= view.end) sq.setTime(view, 0);
  view.tell("state");
  view.draw(true);
};

// The whole run in about twenty seconds, and never slower than it was.
sq.playStep = (view, seconds) => {
  if (!view.state.playing) return;
  const time = view.state.time + seconds * Math.max(1, view.end / 20);
  if (time >= view.end) view.state.playing = false;
  sq.setTime(view, Math.min(view.end, time));
  if (view.state.ride) sq.standAt(view, sq.cameraAt(view, view.state.time), false);
};

sq.setTime = (view, time) => {
  view.state.time = Math.min(view.end, Math.max(0, time));
  sq.applyTime(view);
  view.tell("state");
  view.draw();
};

// Shows what was known at the time of the state.
sq.applyTime = (view) => {
  const {data, state} = view;
  const done = state.time >= view.end;
  const shown = done ? data.keyframes.length : sq.keyframesShown(view);
  const upTo = (counts) => (shown > 0 ? counts[Math.min(shown, counts.length) - 1] : 0);
  if (view.points) view.points.geometry.setDrawRange(0, done ? Infinity : upTo(data.points));
  const share = view.cloudStep || 1;
  if (view.cloud) view.cloud.geometry.setDrawRange(0, done ? Infinity : Math.ceil(upTo(data.cloud) / share));
  view.frusta.geometry.setDrawRange(0, 16 * shown);
  const passed = done ? view.pathTimes.length : sq.countUpTo(view.pathTimes, state.time);
  view.path.show(state.layers.path ? Math.max(0, passed - 1) : 0);
  for (const object of view.objects) {
    const age = done ? 1 : (state.time - object.data.first) / Math.max(0.3, view.end / 40);
    const grown = Math.min(1, Math.max(0, age));
    object.solid.visible = grown > 0 && (state.layers.uncertain || !!state.answers || !object.data.uncertain);
    object.solid.scale.setScalar(0.4 + 0.6 * (1 - (1 - grown) * (1 - grown)));
    if (object.shadow) object.shadow.visible = object.solid.visible && state.layers.objects && !sq.isFaint(view, object);
  }
  sq.showCameraNow(view);
};

sq.drawTimeline = (view) => {
  const canvas = view.root.querySelector(".sq-track canvas");
  const width = canvas.clientWidth;
  const height = canvas.clientHeight;
  canvas.width = width * devicePixelRatio;
  canvas.height = height * devicePixelRatio;
  const pen = canvas.getContext("2d");
  pen.scale(devicePixelRatio, devicePixelRatio);
  const style = getComputedStyle(view.root);
  const color = (name) => style.getPropertyValue(name).trim();
  const at = (time) => 8 + (width - 16) * (view.end > 0 ? time / view.end : 1);
  const y = height / 2;
  const line = (x0, y0, x1, y1, ink, thick) => {
    pen.strokeStyle = ink;
    pen.lineWidth = thick;
    pen.beginPath();
    pen.moveTo(x0, y0);
    pen.lineTo(x1, y1);
    pen.stroke();
  };
  for (const time of view.keyframeTimes) line(at(time), y + 5, at(time), y + 9, color("--faint"), 1);
  line(at(0), y, at(view.end), y, color("--line"), 3);
  line(at(0), y, at(view.state.time), y, color("--accent"), 3);
  for (const object of view.objects) {
    pen.fillStyle = object.data.color;
    pen.globalAlpha = object.data.uncertain ? 0.35 : 1;
    pen.fillRect(at(object.data.first) - 2, y - 10, 4, 4);
  }
  pen.globalAlpha = 1;
  pen.fillStyle = color("--accent");
  pen.beginPath();
  pen.arc(at(view.state.time), y, 6, 0, 7);
  pen.fill();
  view.slider.value = view.end > 0 ? (view.slider.max * view.state.time) / view.end : view.slider.max;
  view.clockText.textContent = sq.clock(view.state.time) + " / " + sq.clock(view.end);
  view.slider.setAttribute("aria-valuetext", view.clockText.textContent);
};
