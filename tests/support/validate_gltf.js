// Prints the issues that Khronos' validator finds in a .glb, as JSON. Exit code 77 where it is not installed
// (npm install -g gltf-validator).
"use strict";
const fs = require("fs");
const path = require("path");
const {execSync} = require("child_process");

let validator;
try {
  const roots = [process.cwd(), execSync("npm root -g", {stdio: ["ignore", "pipe", "ignore"]}).toString().trim()];
  validator = require(require.resolve("gltf-validator", {paths: [...roots, ...roots.map((root) => path.dirname(root))]}));
} catch {
  process.exit(77);
}
validator
  .validateBytes(new Uint8Array(fs.readFileSync(process.argv[2])), {maxIssues: 20})
  .then((report) => console.log(JSON.stringify(report.issues)));
