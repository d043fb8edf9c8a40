// Keyframes' images with the outlines of the objects over them, small and large.

sq.svg = (tag, attributes) => {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  return element;
};

// `chosen`: the object that stands out; undefined: all do alike.
sq.makePhoto = (view, index, chosen) => {
  const keyframe = view.data.keyframes[index];
  const {width, height} = view.data.lens;
  const image = sq.make("img", {src: view.images[keyframe.image], alt: "Keyframe " + keyframe.id + " with outlines"});
  image.loading = "lazy";
  const drawing = sq.svg("svg", {viewBox: `-0.5 -0.5 ${width} ${height}`, preserveAspectRatio: "none"});
  for (const [object, detected, polygon] of [...keyframe.outlines].reverse()) {
    const data = view.data.objects[object];
    if (chosen !== undefined && object !== chosen && !detected) continue;
    const outline = sq.svg("polygon", {points: polygon.join(" "), stroke: data.color, fill: data.color});
    const faint = chosen !== undefined ? object !== chosen : !detected || data.uncertain;
    outline.setAttribute("class", object === chosen ? "sq-chosen" : faint ? "sq-faint" : "");
    outline.append(sq.svg("title", {}));
    outline.firstChild.textContent = data.name;
    drawing.append(outline);
  }
  return sq.make("span", {className: "sq-photo"}, image, drawing);
};

sq.closePhoto = (view) => {
  view.box.hidden = true;
  view.box.replaceChildren();
  (view.box.opener && view.box.opener.isConnected ? view.box.opener : view.canvas).focus({preventScroll: true});
};

// Large, over the view.
sq.openPhoto = (view, index, chosen) => {
  const withImage = view.data.keyframes.map((keyframe, i) => (keyframe.image >= 0 ? i : -1)).filter((i) => i >= 0);
  const place = withImage.indexOf(index);
  if (place < 0) return;
  const keyframe = view.data.keyframes[index];
  const button = (text, act, title) => sq.make("button", {textContent: text, onclick: act, title, ariaLabel: text.length > 1 ? text : title});
  const step = (by) => sq.openPhoto(view, withImage[(place + by + withImage.length) % withImage.length], chosen);
  const stand = () => {
    sq.closePhoto(view);
    sq.standAt(view, sq.poseAt(keyframe.pose));
  };
  const caption = sq.make("figcaption", {},
    sq.make("span", {textContent: `Keyframe ${keyframe.id}, frame ${keyframe.frame}, ${sq.clock(keyframe.time)}`}),
    button("‹", () => step(-1), "The one before"), button("›", () => step(1), "The next one"),
    button("Stand here", stand, "See the map from where this was taken"), button("Close", () => sq.closePhoto(view), "Escape"));
  const figure = sq.make("figure", {}, sq.makePhoto(view, index, chosen), caption);
  figure.style.setProperty("--shape", view.data.lens.width / view.data.lens.height);
  if (view.box.hidden) view.box.opener = document.activeElement;
  view.box.replaceChildren(figure);
  view.box.hidden = false;
  figure.querySelector("button:last-of-type").focus({preventScroll: true});
  view.box.onclick = (event) => event.target === view.box && sq.closePhoto(view);
  view.box.step = step;
};

sq.selectKeyframe = (view, index) => {
  view.state.keyframe = index;
  sq.hangPhoto(view, index);
  if (index >= 0) sq.openPhoto(view, index);
};
