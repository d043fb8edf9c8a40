// Names beside the objects, as elements over the canvas; where two would cover each other the farther one goes.

sq.buildLabels = (view) => {
  view.labelBox = view.root.querySelector(".sq-labels");
  for (const object of view.objects) {
    const dot = sq.make("i");
    dot.style.background = object.data.color;
    object.label = sq.make("div", {className: "sq-label"}, dot, object.data.name);
    object.label.classList.toggle("sq-unsure", object.data.uncertain);
    view.labelBox.append(object.label);
    object.labelSize = [object.label.offsetWidth, object.label.offsetHeight];
    const up = new THREE.Vector3(...view.data.look.up);
    object.top = object.center.clone().addScaledVector(up, object.data.size[2] / 2);
  }
};

sq.placeLabel = (label, x, y, width, height) => {
  label.style.transform = `translate(${Math.round(x - width / 2)}px, ${Math.round(y - height - 5)}px)`;
};

sq.drawLabels = (view) => {
  const taken = [];
  const seen = view.objects
    .map((object) => ({object, at: view.project(object.top)}))
    .sort((a, b) => (b.object.index === view.state.selected) - (a.object.index === view.state.selected) || a.at.z - b.at.z);
  for (const {object, at} of seen) {
    const [width, height] = object.labelSize;
    const box = [at.x - width / 2, at.y - height - 5, at.x + width / 2, at.y - 5];
    const chosen = object.index === view.state.selected;
    const free = at.z < 1 && taken.every((b) => box[2] < b[0] || box[0] > b[2] || box[3] < b[1] || box[1] > b[3]);
    const shown = object.solid.visible && view.objectGroup.visible && free && (chosen || (view.state.layers.labels && !(view.state.answers && sq.isFaint(view, object))));
    object.label.style.visibility = shown ? "visible" : "hidden";
    object.label.classList.toggle("sq-chosen", chosen);
    if (shown) {
      taken.push(box);
      sq.placeLabel(object.label, at.x, at.y, width, height);
    }
  }
};
