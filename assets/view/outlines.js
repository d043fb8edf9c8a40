// Outlines of solids: the curve where a surface turns away from the eye, found on the mesh in each frame.
// Lines cost little without a graphics card; outlines drawn as swollen solids cost more than all else.

sq.segmentsOfObject = 400;  // at most; a superquadric of 36 steps of longitude has about 150

sq.buildOutlines = (view) => {
  const most = view.objects.length * sq.segmentsOfObject;
  view.outlines = {plain: sq.makeLines(view, most, 1.2), faint: sq.makeLines(view, most, 1.3, 0.55), chosen: sq.makeLines(view, most, 3.2)};
  for (const lines of Object.values(view.outlines)) lines.material.depthWrite = false;
  view.outlines.chosen.material.depthTest = false;  // the discs of a dense cloud would hide small objects
  view.outlines.chosen.renderOrder = 8;
  for (const object of view.objects) {
    const {position, normal} = object.solid.geometry.attributes;
    object.mesh = {place: position.array, normal: normal.array, index: object.solid.geometry.index.array, turn: new Float32Array(position.count)};
  }
};

// Appends the outline of one object, as the eye sees it, to lines.
sq.addOutline = (view, object, lines) => {
  const {place, normal, index, turn} = object.mesh;
  const matrix = object.solid.matrixWorld;
  const eye = view.eye.position.clone().applyMatrix4(new THREE.Matrix4().getInverse(matrix));
  for (let i = 0, k = 0; i < turn.length; ++i, k += 3) {
    turn[i] = normal[k] * (eye.x - place[k]) + normal[k + 1] * (eye.y - place[k + 1]) + normal[k + 2] * (eye.z - place[k + 2]);
  }
  const ink = object.ink.toArray().map((part) => 255 * part);
  const ends = [[0, 0, 0], [0, 0, 0]];
  const e = matrix.elements;
  const last = lines.used + sq.segmentsOfObject;
  for (let i = 0; i < index.length && lines.used < last; i += 3) {
    const front = (turn[index[i]] > 0) + (turn[index[i + 1]] > 0) + (turn[index[i + 2]] > 0);
    if (front === 0 || front === 3) continue;
    let end = 0;
    for (let k = 0; k < 3; ++k) {
      const from = index[i + k];
      const to = index[i + ((k + 1) % 3)];
      if (turn[from] > 0 === turn[to] > 0) continue;
      const share = turn[from] / (turn[from] - turn[to]);
      const x = place[3 * from] + share * (place[3 * to] - place[3 * from]);
      const y = place[3 * from + 1] + share * (place[3 * to + 1] - place[3 * from + 1]);
      const z = place[3 * from + 2] + share * (place[3 * to + 2] - place[3 * from + 2]);
      for (let axis = 0; axis < 3; ++axis) ends[end][axis] = e[axis] * x + e[4 + axis] * y + e[8 + axis] * z + e[12 + axis];
      ++end;
    }
    lines.put(lines.used++, ends[0], ends[1], ink);
  }
};

sq.drawOutlines = (view) => {
  const {plain, faint, chosen} = view.outlines;
  for (const lines of [plain, faint, chosen]) lines.used = 0;
  if (view.objectGroup.visible) {
    for (const object of view.objects) {
      if (!object.solid.visible) continue;
      object.solid.updateMatrixWorld();
      const marked = object.index === view.state.selected || view.state.answers?.has(object.index);
      sq.addOutline(view, object, marked ? chosen : sq.isFaint(view, object) ? faint : plain);
    }
  }
  for (const lines of [plain, faint, chosen]) lines.upload(lines.used);
};
