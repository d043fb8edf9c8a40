// Draws the map: ground, points, dense cloud, objects.

// A turn of the plane z = 0 so that its normal is `up`.
sq.groundFrame = (look) => {
  const frame = new THREE.Group();
  const up = new THREE.Vector3(...look.up);
  frame.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), up);
  const center = new THREE.Vector3(...look.center);
  frame.position.copy(center.addScaledVector(up, look.ground - center.dot(up)));
  return frame;
};

// Lines that fade outwards, cells as in the pictures.
sq.makeGrid = (look) => {
  const cells = Math.ceil((2 * look.radius) / look.cell);
  const reach = cells * look.cell;
  const places = [];
  for (let i = -cells; i <= cells; ++i) {
    const half = Math.sqrt(Math.max(0, reach * reach - i * i * look.cell * look.cell));
    places.push(i * look.cell, -half, 0, i * look.cell, half, 0, -half, i * look.cell, 0, half, i * look.cell, 0);
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(places, 3));
  const material = new THREE.ShaderMaterial({
    vertexShader: sq.shadowVertex,
    fragmentShader: sq.gridFragment,
    uniforms: {color: {value: new THREE.Color()}, reach: {value: reach}},
    transparent: true,
    depthWrite: false,
  });
  return new THREE.LineSegments(geometry, material);
};

sq.makePoints = (view, name, size, contrast, spacing) => {
  const found = view.map.getObjectByName(name);
  if (!found) return null;
  found.material = sq.pointMaterial(view.shared, size, contrast);
  found.material.uniforms.spacing.value = spacing;
  found.frustumCulled = false;
  return found;
};

sq.coarsePoints = 10000;  // of a dense cloud that are drawn while the map turns and drawing is slow

// Every so many points of the dense cloud, larger ones; or all of them.
sq.setCoarse = (view, coarse) => {
  if (!view.cloud) return;
  const {geometry, material} = view.cloud;
  const {count} = geometry.attributes.position;
  const every = Math.max(1, Math.ceil(count / sq.coarsePoints));
  if (!view.coarseIndex) {
    const index = new Uint32Array(Math.ceil(count / every)).map((_, i) => i * every);
    view.coarseIndex = new THREE.BufferAttribute(index, 1);
  }
  view.cloudStep = coarse ? every : 1;
  geometry.setIndex(coarse ? view.coarseIndex : null);
  material.uniforms.spacing.value = 1.4 * (view.data.cloud_spacing || 0) * Math.sqrt(view.cloudStep);
  sq.applyTime(view);
};

// Solid and shadow of one object.
sq.makeObject = (view, data, index) => {
  const solid = view.solids.get(data.id);
  solid.material = sq.solidMaterial(data.color, view.shared);
  const object = {data, index, solid, ink: new THREE.Color(), shadow: null, center: solid.position.clone()};
  const ground = view.ground.worldToLocal(solid.position.clone());
  const gap = ground.z - data.size[2] / 2;
  const strength = 0.34 * Math.max(0, 1 - Math.abs(gap) / Math.max(data.size[2], 1e-9));
  if (strength > 0.02 && !data.uncertain) {
    const soft = 0.35 * Math.min(data.size[0], data.size[1], 2 * data.size[2]);
    const plane = new THREE.PlaneBufferGeometry(data.size[0] + 2.2 * soft, data.size[1] + 2.2 * soft);
    object.shadow = new THREE.Mesh(plane, sq.shadowMaterial(data, soft));
    object.shadow.material.uniforms.opacity.value = strength;
    object.shadow.position.set(ground.x, ground.y, 0);
    object.shadow.rotation.z = data.yaw;
    object.shadow.renderOrder = -1;
    view.ground.add(object.shadow);
  }
  return object;
};

// Faint are uncertain objects or, after a question, all but its answers.
sq.isFaint = (view, object) => (view.state.answers ? !view.state.answers.has(object.index) : object.data.uncertain);

// Looks: solids with a thin dark line around them, panes, or lines alone. Faint objects are faint lines; among solids,
// hollow ones are panes, which show what stands in them.
sq.lookOf = (view, object) => (sq.isFaint(view, object) ? "outline" : view.state.look === "solid" && object.data.hollow ? "glass" : view.state.look);

sq.styleObject = (view, object) => {
  const {solid, data} = object;
  const look = sq.lookOf(view, object);
  const chosen = view.state.selected === object.index;
  const pointed = view.state.pointed === object.index;
  const u = solid.material.uniforms;
  const glass = look === "glass" || (look === "outline" && (chosen || pointed));
  solid.material.visible = look === "solid" || glass;
  solid.material.transparent = glass;
  solid.material.depthWrite = !glass;
  u.opacity.value = glass ? 0.16 : 1;
  u.rim.value = glass ? 0.4 : 0;
  u.glow.value = pointed ? 1 : 0;
  if (chosen) object.ink.set(view.colors.accent);
  else if (look !== "solid") object.ink.set(data.color);
  else object.ink.set(data.color).lerp(new THREE.Color("#101418"), 0.55);
};

sq.buildScene = (view) => {
  const {data} = view;
  view.scene = new THREE.Scene();
  view.map = view.gltf.scene.children[0];
  view.map.quaternion.set(0, 0, 0, 1);  // z up, as all else in the page
  view.scene.add(view.map);
  view.solids = new Map();
  view.map.traverse((node) => {
    if (node.isMesh && node.userData.id !== undefined) view.solids.set(node.userData.id, node);
  });
  view.ground = sq.groundFrame(data.look);
  view.grid = sq.makeGrid(data.look);
  view.ground.add(view.grid);
  view.scene.add(view.ground);
  view.scene.updateMatrixWorld(true);
  view.points = sq.makePoints(view, "points", 2.4, 0.28, 0);
  view.cloud = sq.makePoints(view, "cloud", 1.5, 0, 1.4 * (data.cloud_spacing || 0));
  view.objects = data.objects.map((object, index) => sq.makeObject(view, object, index));
};
