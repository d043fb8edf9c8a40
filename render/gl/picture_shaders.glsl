// The fragment programs of PicturePass and of solids, without the declarations of their outputs. The build turns this
// file into picture_shaders.h: a line "//// NAME" begins the constant NAME. The programs for the finished picture fill
// VTK's full-screen template, whose coordinate `texCoord` is in [0, 1].

//// kLight
// Light on solids, in place of VTK's: diffuse by the room's irradiance, reflection by Schlick's Fresnel term
// in the approximation of Karis, "Physically based shading on mobile" (2014). Far sides, seen through near
// ones, have no reflection. `parallelRays`: the view is orthographic. `roomUp`, `roomLamp` and `roomWindow` are directions in the view frame; VTK declares
// them, like all custom uniforms of an actor.
  vec3 albedo = diffuseColor * diffuseColor;
  vec3 faced = vec3(dot(normalVCVSOutput, roomUp), dot(normalVCVSOutput, roomLamp), dot(normalVCVSOutput, roomWindow));
  vec3 lit = (1.0 - metallic) * albedo * studioIrradiance(faced);
#ifndef FAR_SIDE
  int near = gl_FrontFacing ? 1 : 0;
  for (int once = 0; once < near; ++once) {
  vec3 toEye = parallelRays != 0 ? vec3(0.0, 0.0, 1.0) : normalize(-vertexVC.xyz);
  float facing = clamp(dot(normalVCVSOutput, toEye), 0.0, 1.0);
  vec3 mirrored = 2.0 * facing * normalVCVSOutput - toEye;
  vec4 r = roughness * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
  float a = min(r.x * r.x, exp2(-9.28 * facing)) * r.x + r.y;
  vec3 reflected = mix(vec3(0.04), albedo, metallic) * (r.z - 1.04 * a) + vec3(r.w + 1.04 * a);
  lit += reflected * studioReflection(vec3(dot(mirrored, roomUp), dot(mirrored, roomLamp), dot(mirrored, roomWindow)),
                                      roughness);
  }
#endif
  gl_FragData[0] = vec4(sqrt(clamp(lit, 0.0, 1.0)), opacity);

//// kPhotographed
// Light on colours from photographs, which already contain the light of their room: weak shading from over the
// viewer's left shoulder.
  gl_FragData[0] = vec4(diffuseColor * (0.84 + 0.22 * dot(normalVCVSOutput, vec3(-0.36, 0.56, 0.75))), 1.0);

//// kSurfaceOutput
// The second output of solids: the normal in the view frame and the solid's number, all in [0, 1] with eight bits. A
// target with more bits would cost a software renderer more than all effects together. Solids that write no depth
// store their distance in the last eight bits: log2(distance / surfaceRange.x) * surfaceRange.y.
#ifdef SEE_THROUGH
  float far = clamp(log2(-vertexVC.z / surfaceRange.x) * surfaceRange.y, 0.0, 1.0);
#else
  float far = step(0.5, opacity);  // no ambient occlusion on glass
#endif
  gl_FragData[1] = vec4(0.5 * normalVCVSOutput.xy + 0.5, (mod(floor(solidNumber - 0.5), 250.0) + 2.0) / 255.0, far);

//// kNearer
// Moves a solid towards the camera by a fixed share of its distance, which is a constant in clip space.
//VTK::PositionVC::Impl
  gl_Position.z -= nearer;

//// kSplatVertex
//VTK::System::Dec
in vec3 placeMC;
in float size;
in float frame;
in vec4 rgba;
uniform mat4 toDevice;
uniform float focal;
uniform float scale;
uniform int inMapUnits;
uniform float least;
uniform float leastSize;
uniform float newest;
uniform vec4 cut;
flat out vec4 splatColor;
void main() {
  splatColor = rgba;
  gl_Position = toDevice * vec4(placeMC, 1.0);
  float diameter = max(size, leastSize) * (inMapUnits != 0 ? focal / gl_Position.w : scale);
  gl_PointSize = clamp(diameter, least, 60.0);
  if (frame > newest || dot(cut.xyz, placeMC) > cut.w) {
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  }
}

//// kSplatFragment
//VTK::System::Dec
//VTK::Output::Dec
flat in vec4 splatColor;
void main() {
  vec2 away = gl_PointCoord - 0.5;
  if (dot(away, away) > 0.25) {
    discard;
  }
  gl_FragData[0] = splatColor;
}

//// kLens
// Shared by the programs below: the distance along the line of sight, and the point in the view frame for a place in
// the picture and a distance. `lens` is (P00, P11, P02, P12) of the projection; PARALLEL is 1 for orthographic ones.
uniform vec4 lens;
uniform vec2 depthRange;
uniform sampler2D surfaces;
uniform sampler2D depths;
#if PARALLEL
float distanceAt(ivec2 at) { return mix(depthRange.x, depthRange.y, texelFetch(depths, at, 0).x); }
float nearnessAt(ivec2 at) { return 1.0 / distanceAt(at); }
float spreadAt(float depth) { return 1.0; }  // of the rays
#else
float nearnessAt(ivec2 at) {  // 1 / distance
  return mix(1.0 / depthRange.x, 1.0 / depthRange.y, texelFetch(depths, at, 0).x);
}
float distanceAt(ivec2 at) { return 1.0 / nearnessAt(at); }
float spreadAt(float depth) { return depth; }
#endif
vec3 pointAt(vec2 at, float depth) {
  vec2 device = 2.0 * at - 1.0;
  float spread = spreadAt(depth);
  return vec3(spread * (device.x + lens.z) / lens.x, spread * (device.y + lens.w) / lens.y, -depth);
}

//// kOcclusionDeclarations
// Ambient occlusion after McGuire, Osman, Bukowski and Hennessy, "The Alchemy screen-space ambient obscurance
// algorithm" (2011), Eq. 10, on a spiral of samples that turns from pixel to pixel in a 4 x 4 pattern.
uniform ivec2 target;
uniform int taps;
uniform int surfacesPerPixel;
uniform float radius;
uniform vec4 ground;
uniform int hasGround;

//// kOcclusion
  ivec2 last = textureSize(surfaces, 0) - 1;
  vec2 size = vec2(last + 1);
  ivec2 pixel = ivec2(texCoord * vec2(target));
  ivec2 here = min(pixel * surfacesPerPixel, last);
  vec4 surface = texelFetch(surfaces, here, 0);
  float open = 1.0;
  float distance = 0.0;
  int solid = surface.z > 0.0 ? 1 : 0;
  for (int once = 0; once < solid; ++once) {  // skipped where there is no solid
    distance = distanceAt(here);
    vec3 p = pointAt((vec2(here) + 0.5) / size, distance);
    vec2 across = 2.0 * surface.xy - 1.0;
    vec3 n = vec3(across, sqrt(max(0.0, 1.0 - dot(across, across))));
    ivec2 cell = pixel & 3;
    float turn = 0.3926991 * float((cell.x * 5 + cell.y * 7 + cell.x * cell.y * 3) & 15);
    vec2 reach = min(0.5 * radius * lens.xy / spreadAt(distance), vec2(0.25));
    float sum = 0.0;
    bool above = hasGround != 0 && dot(ground.xyz, p) + ground.w > 0.0;
    for (int i = 0; i < taps; ++i) {
      float share = (float(i) + 0.5) / float(taps);
      float angle = turn + 2.3999632 * float(i);
      vec2 at = (vec2(here) + 0.5) / size + share * reach * vec2(cos(angle), sin(angle));
      ivec2 there = clamp(ivec2(at * size), ivec2(0), last);
      float depth = texelFetch(surfaces, there, 0).z > 0.0 ? distanceAt(there) : 0.0;
      if (above) {
#if PARALLEL
        float hit = ground.z != 0.0 ? (dot(ground.xyz, pointAt(at, 0.0)) + ground.w) / ground.z : 0.0;
#else
        vec3 ray = pointAt(at, 1.0);
        float facing = dot(ground.xyz, ray);
        float hit = facing != 0.0 ? -ground.w / facing : 0.0;
#endif
        depth = hit > 0.0 && (depth <= 0.0 || hit < depth) ? hit : depth;
      }
      vec3 v = pointAt(at, depth) - p;
      float squared = dot(v, v);
      float fade = depth > 0.0 ? max(0.0, 1.0 - squared / (radius * radius)) : 0.0;
      sum += fade * max(0.0, dot(v, n) - 0.02 * radius) / (sqrt(squared) + 0.02 * radius);
    }
    open = max(0.0, 1.0 - 2.6 * sum / float(max(taps, 1)));
  }
  gl_FragData[0] = vec4(open, distance, 0.0, 1.0);

//// kSmoothingDeclarations
// The mean over the 4 x 4 pattern of neighbours at a similar distance. The second channel is the distance, or -1
// beside a solid, or 0 elsewhere.
uniform sampler2D occlusion;
uniform float radius;

//// kSmoothing
  ivec2 last = textureSize(occlusion, 0) - 1;
  ivec2 at = ivec2(texCoord * vec2(last + 1));
  vec2 middle = texelFetch(occlusion, at, 0).xy;
  float sum = 0.0;
  float weights = 0.0;
  int solid = middle.y > 0.0 ? 1 : 0;
  for (int once = 0; once < solid; ++once) {
    for (int y = -2; y < 2; ++y) {
      for (int x = -2; x < 2; ++x) {
        vec2 other = texelFetch(occlusion, clamp(at + ivec2(x, y), ivec2(0), last), 0).xy;
        float weight = other.y > 0.0 && abs(other.y - middle.y) < 0.5 * radius ? 1.0 : 0.0;
        sum += weight * other.x;
        weights += weight;
      }
    }
  }
  float beside = texelFetch(occlusion, ivec2(min(at.x + 1, last.x), at.y), 0).y;
  beside = max(beside, texelFetch(occlusion, ivec2(max(at.x - 1, 0), at.y), 0).y);
  beside = max(beside, texelFetch(occlusion, ivec2(at.x, min(at.y + 1, last.y)), 0).y);
  beside = max(beside, texelFetch(occlusion, ivec2(at.x, max(at.y - 1, 0)), 0).y);
  gl_FragData[0] = vec4(weights > 0.0 ? sum / weights : 1.0,
                        middle.y > 0.0 ? middle.y : (beside > 0.0 ? -1.0 : 0.0), 0.0, 1.0);

//// kFinishDeclarations
// One pixel of the picture from its samples. SAMPLES, NEAR_SOLIDS, OCCLUSION, OUTLINE, EYE_DOME and SEE_THROUGH are
// defined before. Effects that few pixels need are loops of at most one round: a software renderer executes both sides
// of every branch, but skips a loop.
uniform sampler2D colors;
uniform sampler2D occlusion;
uniform sampler2D lineColors;
uniform vec3 surfaceRange;  // see SolidActors::Surroundings
uniform int occlusionStep;
uniform float occlusionStrength;
uniform float radius;
uniform vec2 outlineWidths;  // around solids, around glass
uniform float eyeDome;
uniform vec4 background;  // red, green, blue times alpha, and alpha

// Darkens the drawn share of a pixel (alpha of `sum`), not the background.
vec3 shaded(vec4 sum, float light) {
  vec3 paper = (1.0 - sum.a) * background.rgb;
  return paper + light * (sum.rgb - paper);
}

// 0 within an even surface, more than 0.4 where it may end or bend.
float changeBetween(vec4 a, vec4 b) {
  return (abs(a.z - b.z) > 1e-4 ? 1.0 : 0.0) + 2.0 * max(abs(a.x - b.x), abs(a.y - b.y));
}

// 1 if `other` shows another solid or none, and this one is nearer; less at a crease.
float edgeTowards(vec4 surface, float distance, ivec2 other) {
  vec4 beside = texelFetch(surfaces, other, 0);
  vec2 turn = 2.0 * abs(beside.xy - surface.xy);
#if SEE_THROUGH
  bool nearer = beside.z > 0.0 ? beside.z < surface.z : distanceAt(other) > surfaceRange.z * distance;
#else
  bool nearer = distanceAt(other) > distance;
#endif
  return beside.z != surface.z ? (nearer ? 1.0 : 0.0) : 0.45 * smoothstep(0.45, 0.8, max(turn.x, turn.y));
}

float openness(vec2 at, float depth) {
  ivec2 size = textureSize(occlusion, 0);
  ivec2 base = ivec2(floor(at - 0.5));
  vec2 part = at - 0.5 - vec2(base);
  float sum = 0.0;
  float weights = 0.0;
  for (int y = 0; y < 2; ++y) {
    for (int x = 0; x < 2; ++x) {
      vec2 o = texelFetch(occlusion, clamp(base + ivec2(x, y), ivec2(0), size - 1), 0).xy;
      float weight = (x == 0 ? 1.0 - part.x : part.x) * (y == 0 ? 1.0 - part.y : part.y);
      weight *= o.y > 0.0 ? 1.0 / (0.02 + abs(o.y - depth) / radius) : 0.0;
      sum += weight * o.x;
      weights += weight;
    }
  }
  return weights > 0.0 ? sum / weights : 1.0;
}

//// kFinish
  // The filter of a texture takes the mean of the 2 x 2 samples of a pixel.
#if SAMPLES == 1
  vec4 sum = texelFetch(colors, ivec2(texCoord * vec2(textureSize(colors, 0))), 0);
#else
  vec4 sum = texture(colors, texCoord);
#endif
#if OCCLUSION || OUTLINE || EYE_DOME
  ivec2 size = textureSize(colors, 0);
  ivec2 last = size - 1;
  ivec2 pixel = ivec2(texCoord * vec2(size / SAMPLES));
  ivec2 corner = pixel * SAMPLES;
#if EYE_DOME
  // Eye-dome lighting (Boucheny, 2009) with the four neighbours.
  int points = texelFetch(depths, corner, 0).x < 1.0 ? 1 : 0;
#if NEAR_SOLIDS && !SEE_THROUGH
  points = texelFetch(surfaces, corner, 0).z > 0.0 ? 0 : points;
#endif
  for (int once = 0; once < points; ++once) {
    float nearest = max(max(nearnessAt(ivec2(max(corner.x - SAMPLES, 0), corner.y)),
                            nearnessAt(ivec2(min(corner.x + SAMPLES, last.x), corner.y))),
                        max(nearnessAt(ivec2(corner.x, max(corner.y - SAMPLES, 0))),
                            nearnessAt(ivec2(corner.x, min(corner.y + SAMPLES, last.y)))));
    sum.rgb = shaded(sum, 1.0 - eyeDome * (1.0 - exp2(-25.0 * max(0.0, nearest / nearnessAt(corner) - 1.0))));
  }
#endif
#if OCCLUSION || OUTLINE
  int near = texelFetch(occlusion, corner / occlusionStep, 0).y != 0.0 ? 1 : 0;
  for (int once = 0; once < near; ++once) {
    vec4 first = texelFetch(surfaces, corner, 0);
    vec4 mean = texture(surfaces, texCoord);
#if OCCLUSION
    float open = openness((vec2(corner) + 0.5 * float(SAMPLES)) / float(occlusionStep), distanceAt(corner));
    sum.rgb = shaded(sum, 1.0 - occlusionStrength * (1.0 - open) * mean.w);
#endif
#if OUTLINE
    ivec2 reaches = max(ivec2(1), ivec2(0.5 * outlineWidths * float(SAMPLES) + 0.5));
    int widest = max(reaches.x, reaches.y);
    ivec2 beyond = min(corner + widest + SAMPLES - 1, last);
    ivec2 before = max(corner - widest, ivec2(0));
    float change = float(SAMPLES * SAMPLES) * changeBetween(first, mean);
    change = max(change, changeBetween(first, texelFetch(surfaces, ivec2(beyond.x, corner.y), 0)));
    change = max(change, changeBetween(first, texelFetch(surfaces, ivec2(corner.x, beyond.y), 0)));
    change = max(change, changeBetween(first, texelFetch(surfaces, ivec2(before.x, corner.y), 0)));
    change = max(change, changeBetween(first, texelFetch(surfaces, ivec2(corner.x, before.y), 0)));
    int edges = mean.z > 0.0 && change > 0.4 ? SAMPLES : 0;
    float edge = 0.0;
    vec3 ink = vec3(0.0);
    for (int i = 0; i < edges; ++i) {  // two of four samples are enough for smooth lines
      ivec2 at = corner + i;
      vec4 surface = texelFetch(surfaces, at, 0);
#if SEE_THROUGH
      float far = surfaceRange.x * exp2(surface.w / surfaceRange.y);
      int reach = reaches.y;
#else
      float far = distanceAt(at);
      int reach = surface.w > 0.5 ? reaches.x : reaches.y;
#endif
      float here = edgeTowards(surface, far, ivec2(max(at.x - reach, 0), at.y));
      here = max(here, edgeTowards(surface, far, ivec2(min(at.x + reach, last.x), at.y)));
      here = max(here, edgeTowards(surface, far, ivec2(at.x, max(at.y - reach, 0))));
      here = max(here, edgeTowards(surface, far, ivec2(at.x, min(at.y + reach, last.y))));
      here *= surface.z > 0.0 ? 1.0 : 0.0;
      vec4 line = texelFetch(lineColors, ivec2(int(255.0 * surface.z + 0.5), 0), 0);
      edge += here * line.a;
      ink += here * line.a * line.rgb;
    }
    ink /= max(edge, 1e-6);
    edge /= float(SAMPLES);
    sum = vec4(mix(sum.rgb, ink, edge), mix(sum.a, 1.0, edge));
#endif
  }
#endif
#endif
  gl_FragData[0] = vec4(sum.rgb, max(sum.a, background.a));

//// kSmoothEdgesDeclarations
// Smooth edges after Lottes, "FXAA" (2009), in the short form that takes four corners for the direction of an
// edge and blurs along it. Pixels without contrast leave the loop at once.
uniform sampler2D finished;
float luma(vec4 color) { return dot(color.rgb, vec3(0.299, 0.587, 0.114)); }

//// kSmoothEdges
  ivec2 size = textureSize(finished, 0);
  ivec2 at = ivec2(texCoord * vec2(size));
  ivec2 low = max(at - 1, ivec2(0));
  ivec2 high = min(at + 1, size - 1);
  vec4 color = texelFetch(finished, at, 0);
  float middle = luma(color);
  float a = luma(texelFetch(finished, low, 0));
  float b = luma(texelFetch(finished, ivec2(high.x, low.y), 0));
  float c = luma(texelFetch(finished, ivec2(low.x, high.y), 0));
  float d = luma(texelFetch(finished, high, 0));
  float darkest = min(middle, min(min(a, b), min(c, d)));
  float brightest = max(middle, max(max(a, b), max(c, d)));
  int edge = brightest - darkest > max(0.04, 0.125 * brightest) ? 1 : 0;
  for (int once = 0; once < edge; ++once) {
    vec2 along = vec2(a + b - c - d, b + d - a - c);
    float flatness = max((a + b + c + d) * 0.03125, 0.0078125);
    along = clamp(along / (min(abs(along.x), abs(along.y)) + flatness), -8.0, 8.0) / vec2(size);
    vec4 near = 0.5 * (texture(finished, texCoord - along / 6.0) + texture(finished, texCoord + along / 6.0));
    vec4 wide = 0.5 * near + 0.25 * (texture(finished, texCoord - 0.5 * along) +
                                     texture(finished, texCoord + 0.5 * along));
    float light = luma(wide);
    color = light < darkest || light > brightest ? near : wide;
  }
  gl_FragData[0] = color;
