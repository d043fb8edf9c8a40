// Finds the place under the pointer; measures distances between two places.

sq.rayAt = (view, x, y) => {
  const caster = new THREE.Raycaster();
  caster.setFromCamera(new THREE.Vector2((2 * x) / view.canvas.clientWidth - 1, 1 - (2 * y) / view.canvas.clientHeight), view.eye);
  return caster;
};

// {object, point} of the nearest object there, or null.
sq.objectAt = (view, x, y) => {
  if (!view.objectGroup.visible) return null;
  const shown = view.objects.filter((object) => object.solid.visible);
  const hits = sq.rayAt(view, x, y).intersectObjects(shown.map((object) => object.solid), false);
  return hits.length > 0 ? {object: shown.find((object) => object.solid === hits[0].object), point: hits[0].point} : null;
};

// The nearest place on an object, or the point of map or cloud nearest to the pointer on the screen.
sq.placeAt = (view, x, y) => {
  const hit = sq.objectAt(view, x, y);
  let best = hit && {place: hit.point, depth: view.project(hit.point).z};
  let nearest = 9;
  const matrix = new THREE.Matrix4().multiplyMatrices(view.eye.projectionMatrix, view.eye.matrixWorldInverse);
  const place = new THREE.Vector3();
  for (const points of [view.points, view.cloud]) {
    if (!points || !points.visible) continue;
    const positions = points.geometry.attributes.position;
    const count = Math.min(positions.count, view.cloudStep > 1 ? positions.count : points.geometry.drawRange.count);
    for (let i = 0; i < count; ++i) {
      place.fromBufferAttribute(positions, i).applyMatrix4(matrix);
      const away = Math.hypot(((place.x + 1) / 2) * view.canvas.clientWidth - x, ((1 - place.y) / 2) * view.canvas.clientHeight - y);
      if (place.z < 1 && away < nearest && (!hit || place.z < best.depth)) {
        nearest = away;
        best = {place: new THREE.Vector3().fromBufferAttribute(positions, i), depth: hit ? best.depth : place.z};
      }
    }
  }
  return best && best.place;
};

sq.buildMeasure = (view) => {
  view.measured = [];
  view.measureMarks = new THREE.Group();
  view.scene.add(view.measureMarks);
  view.measureLabel = sq.make("div", {className: "sq-label sq-length"});
  view.measureLabel.style.visibility = "hidden";
  view.labelBox.append(view.measureLabel);
};

sq.setMeasuring = (view, on) => {
  view.state.measuring = on;
  view.measured = [];
  view.root.classList.toggle("sq-measuring", on);
  view.hint(on ? "Click two places: on objects or on points" : "");
  sq.markMeasured(view);
  view.tell("state");
};

sq.measureClick = (view, x, y) => {
  const place = sq.placeAt(view, x, y);
  if (!place) return view.hint("Nothing there: click on an object or on a point");
  view.measured = view.measured.length === 2 ? [place] : [...view.measured, place];
  view.hint(view.measured.length === 1 ? "And the second place" : "");
  sq.markMeasured(view);
};

sq.markMeasured = (view) => {
  view.measureMarks.clear ? view.measureMarks.clear() : view.measureMarks.remove(...view.measureMarks.children);
  const color = view.colors.accent;
  if (view.measured.length > 0) {
    const dots = new THREE.Points(new THREE.BufferGeometry().setFromPoints(view.measured),
      new THREE.PointsMaterial({color, size: 9 * view.ratio, sizeAttenuation: false, depthTest: false, transparent: true}));
    const line = new THREE.Line(new THREE.BufferGeometry().setFromPoints(view.measured),
      new THREE.LineBasicMaterial({color, depthTest: false, transparent: true}));
    dots.renderOrder = line.renderOrder = 9;
    view.measureMarks.add(dots, line);
  }
  view.draw();
};

sq.drawMeasure = (view) => {
  const both = view.measured.length === 2;
  view.measureLabel.style.visibility = both ? "visible" : "hidden";
  if (!both) return;
  const [a, b] = view.measured;
  view.measureLabel.textContent = sq.length(view, a.distanceTo(b));
  const at = view.project(a.clone().add(b).multiplyScalar(0.5));
  sq.placeLabel(view.measureLabel, at.x, at.y, view.measureLabel.offsetWidth, view.measureLabel.offsetHeight);
};
