// The data in the page: packed as zlib and base64 by the program.

sq.element = (id) => document.getElementById(id);

sq.unpack = async (id) => {
  const text = atob(sq.element(id).textContent);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Response(stream).arrayBuffer();
};

// {scene, gltf, images}: the JSON, what GLTFLoader made of the .glb, and addresses of JPEG images.
sq.load = async () => {
  if (typeof DecompressionStream === "undefined") {
    throw new Error("This browser is too old to unpack the map: one from 2023 or later can.");
  }
  const [json, glb] = await Promise.all([sq.unpack("sq-scene"), sq.unpack("sq-glb")]);
  const gltf = await new Promise((done, failed) => new THREE.GLTFLoader().parse(glb, "", done, failed));
  const packed = sq.element("sq-images").textContent.trim();
  return {
    scene: JSON.parse(new TextDecoder().decode(json)),
    gltf,
    images: packed === "" ? [] : packed.split("\n").map((image) => "data:image/jpeg;base64," + image),
  };
};

// Reads [x, y, z, qx, qy, qz, qw] from `list` at a position.
sq.poseAt = (list, at = 0) => ({
  position: new THREE.Vector3(list[at], list[at + 1], list[at + 2]),
  rotation: new THREE.Quaternion(list[at + 3], list[at + 4], list[at + 5], list[at + 6]),
});

// How many of the rising numbers are at most `value`.
sq.countUpTo = (numbers, value) => {
  let low = 0;
  let high = numbers.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (numbers[middle] <= value) low = middle + 1;
    else high = middle;
  }
  return low;
};

// A length of the map for people.
sq.length = (view, length) => {
  if (!(view.data.metres > 0)) return length.toPrecision(3) + " units";
  const metres = length * view.data.metres;
  return metres < 1 ? (100 * metres).toFixed(1) + " cm" : metres.toFixed(2) + " m";
};

sq.clock = (seconds) => {
  const tenths = Math.round(10 * seconds);  // first, so that no minute has 60.0 s
  return Math.floor(tenths / 600) + ":" + ((tenths % 600) / 10).toFixed(1).padStart(4, "0");
};

// Makes an element: sq.make("b", {className: "x"}, "text", child).
sq.make = (tag, properties = {}, ...children) => {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children);
  return element;
};
