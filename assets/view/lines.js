// Lines of any width: a quad for each segment, turned towards the eye. (Line2 of three.js draws instances, each
// of which costs as much as a draw call where there is no graphics card.)

sq.lineVertex = `
attribute vec3 to, ink;
attribute vec2 corner;
uniform vec2 canvas;
uniform float width;
varying vec3 vInk;
void main() {
  vInk = ink;
  vec4 a = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  vec4 b = projectionMatrix * modelViewMatrix * vec4(to, 1.0);
  float least = 1e-4;  // what is behind the eye is cut off
  if (a.w < least && b.w > a.w) a = mix(a, b, (least - a.w) / (b.w - a.w));
  if (b.w < least && a.w > b.w) b = mix(b, a, (least - b.w) / (a.w - b.w));
  vec2 along = normalize((b.xy / b.w - a.xy / a.w) * canvas + vec2(1e-7, 0.0));
  vec4 p = corner.x < 0.5 ? a : b;
  vec2 shift = vec2(-along.y, along.x) * corner.y + along * (corner.x - 0.5) * 0.6;
  p.xy += shift * width / canvas * p.w;
  gl_Position = p;
}`;

sq.lineFragment = `
uniform float opacity;
uniform vec3 color;
varying vec3 vInk;
void main() { gl_FragColor = vec4(color * vInk, opacity); }`;

// `most`: segments that there will be at most. put(i, from, to, ink) sets one, upload(count) hands them over,
// show(count) draws the first ones alone.
sq.makeLines = (view, most, width, opacity = 1) => {
  const geometry = new THREE.BufferGeometry();
  const attribute = (name, size, make = Float32Array, normalized = false) => {
    const buffer = new THREE.BufferAttribute(new make(4 * size * Math.max(1, most)), size, normalized);
    buffer.setUsage(THREE.DynamicDrawUsage);
    geometry.setAttribute(name, buffer);
    return buffer;
  };
  const buffers = [attribute("position", 3), attribute("to", 3), attribute("ink", 3, Uint8Array, true)];
  const corners = attribute("corner", 2).array;
  const index = new Uint32Array(6 * Math.max(1, most));
  for (let i = 0; i < most; ++i) {
    corners.set([0, -1, 1, -1, 0, 1, 1, 1], 8 * i);
    index.set([4 * i, 4 * i + 1, 4 * i + 2, 4 * i + 2, 4 * i + 1, 4 * i + 3], 6 * i);
  }
  geometry.setIndex(new THREE.BufferAttribute(index, 1));
  const material = new THREE.ShaderMaterial({
    vertexShader: sq.lineVertex,
    fragmentShader: sq.lineFragment,
    uniforms: {color: {value: new THREE.Color(1, 1, 1)}, width: {value: width}, opacity: {value: opacity}, canvas: view.shared.canvas},
    transparent: opacity < 1,
    side: THREE.DoubleSide,
  });
  const lines = new THREE.Mesh(geometry, material);
  lines.frustumCulled = false;
  lines.put = (i, from, to, ink) => {
    for (let k = 12 * i; k < 12 * i + 12; k += 3) {
      for (let axis = 0; axis < 3; ++axis) {
        buffers[0].array[k + axis] = from[axis];
        buffers[1].array[k + axis] = to[axis];
        buffers[2].array[k + axis] = ink[axis];
      }
    }
  };
  lines.show = (count) => {
    geometry.setDrawRange(0, 6 * count);
    lines.visible = count > 0;
  };
  lines.upload = (count) => {
    for (const buffer of buffers) {
      buffer.updateRange = {offset: 0, count: 12 * count};
      buffer.needsUpdate = true;
    }
    lines.show(count);
  };
  view.scene.add(lines);
  return lines;
};

// A line through places [x, y, z, x, y, z, ...].
sq.makeLine = (view, places, width) => {
  const count = Math.max(0, places.length / 3 - 1);
  const line = sq.makeLines(view, count, width);
  const place = (i) => places.slice(3 * i, 3 * i + 3);
  for (let i = 0; i < count; ++i) line.put(i, place(i), place(i + 1), [255, 255, 255]);
  line.upload(count);
  return line;
};
