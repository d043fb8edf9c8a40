// Shaders of solids, their shadows and of points. Colours of solids are sRGB, and light adds in squares of them, near
// enough to linear; those of points are linear, as glTF has them. They are kept short: many look at a page without a
// graphics card.

sq.solidVertex = `
uniform vec3 color, up;
uniform float opacity, rim, glow;
varying vec4 vColor;
void main() {
  vec4 p = modelViewMatrix * vec4(position, 1.0);
  vec3 n = normalize(normalMatrix * normal), e = normalize(-p.xyz);
  vec3 above = normalize((viewMatrix * vec4(up, 0.0)).xyz);
  vec3 lamp = normalize(above * 0.9 + vec3(-0.4, 0.0, 0.7));
  float facing = abs(dot(n, e));
  float light = 0.38 + 0.2 * dot(n, above) + 0.6 * max(dot(n, lamp), 0.0);
  float gloss = pow(max(dot(n, normalize(lamp + e)), 0.0), 28.0);
  vColor = vec4(sqrt(color * color * light + 0.1 * gloss + 0.1 * glow), opacity + rim * (1.0 - facing) * (1.0 - facing));
  gl_Position = projectionMatrix * p;
}`;

sq.solidFragment = `
varying vec4 vColor;
void main() { gl_FragColor = vColor; }`;

sq.shadowVertex = `
varying vec2 vAt;
void main() { vAt = position.xy; gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }`;

sq.shadowFragment = `
uniform vec2 halfSize;
uniform float power, soft, opacity;
varying vec2 vAt;
void main() {
  vec2 q = abs(vAt) / halfSize;
  float r = pow(pow(q.x, power) + pow(q.y, power), 1.0 / power);
  float away = (r - 1.0) * min(halfSize.x, halfSize.y) / soft;
  gl_FragColor = vec4(0.0, 0.0, 0.0, opacity * (1.0 - smoothstep(-0.6, 1.0, away)));
}`;

sq.gridFragment = `
uniform vec3 color;
uniform float reach;
varying vec2 vAt;
void main() {
  float fade = max(0.0, 1.0 - length(vAt) / reach);
  gl_FragColor = vec4(color, 0.8 * fade);
}`;

sq.pointVertex = `
attribute vec3 color;
uniform float size, spacing, pixelsAtOne, paper, contrast;
varying vec3 vColor;
void main() {
  vec4 p = modelViewMatrix * vec4(position, 1.0);
  gl_Position = projectionMatrix * p;
  gl_PointSize = spacing > 0.0 ? clamp(spacing * pixelsAtOne / -p.z, size, 9.0 * size) : size;
  vec3 c = mix(12.92 * color, 1.055 * pow(color, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, color));  // sRGB
  float light = dot(c, vec3(0.2126, 0.7152, 0.0722));
  if (paper > 0.5) {
    c *= min(1.0, (paper - contrast) / max(light, 1e-3));
  } else {
    c = mix(c, vec3(1.0), clamp((paper + contrast - light) / (1.0 - light + 1e-3), 0.0, 1.0));
  }
  vColor = c;
}`;

sq.pointFragment = `
varying vec3 vColor;
void main() {
  vec2 d = gl_PointCoord - 0.5;
  if (dot(d, d) > 0.25) discard;
  gl_FragColor = vec4(vColor, 1.0);
}`;

// Uniforms that all materials share: they are changed in one place.
sq.sharedUniforms = (up) => ({
  up: {value: up.clone()},
  canvas: {value: new THREE.Vector2(1, 1)},
  pixelsAtOne: {value: 1},
  paper: {value: 1},
});

sq.solidMaterial = (color, shared) =>
  new THREE.ShaderMaterial({
    vertexShader: sq.solidVertex,
    fragmentShader: sq.solidFragment,
    uniforms: {color: {value: new THREE.Color(color)}, opacity: {value: 1}, rim: {value: 0}, glow: {value: 0}, up: shared.up},
    polygonOffset: true,  // behind its own outline
    polygonOffsetFactor: 1.5,
    polygonOffsetUnits: 4,
  });

sq.shadowMaterial = (object, soft) =>
  new THREE.ShaderMaterial({
    vertexShader: sq.shadowVertex,
    fragmentShader: sq.shadowFragment,
    uniforms: {
      halfSize: {value: new THREE.Vector2(object.size[0] / 2, object.size[1] / 2)},
      power: {value: 2 / object.shape[1]},
      soft: {value: soft},
      opacity: {value: 0.3},
    },
    transparent: true,
    depthWrite: false,
  });

sq.pointMaterial = (shared, size, contrast) =>
  new THREE.ShaderMaterial({
    vertexShader: sq.pointVertex,
    fragmentShader: sq.pointFragment,
    uniforms: {size: {value: size}, spacing: {value: 0}, contrast: {value: contrast}, pixelsAtOne: shared.pixelsAtOne, paper: shared.paper},
  });
