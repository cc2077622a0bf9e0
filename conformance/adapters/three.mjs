// Prints the bounding box and the number of triangles of a VRML97 file as three.js reads it.
//   node three.mjs FOLDER FILE     FOLDER has node_modules/three
import { readFileSync } from "node:fs";
import { resolve } from "node:path";
import { pathToFileURL } from "node:url";

const [folder, file] = process.argv.slice(2);
const load = (name) => import(pathToFileURL(resolve(folder, "node_modules/three", name)));
const messages = [];
for (const kind of ["log", "warn", "error"]) console[kind] = (...words) => messages.push(words.join(" "));
globalThis.document = { createElementNS: () => ({ addEventListener() {}, removeEventListener() {} }) };

const THREE = await load("build/three.module.js");
const loader = await load("examples/jsm/loaders/VRMLLoader.js");
const scene = new loader.VRMLLoader().parse(readFileSync(file, "utf8"), "");
scene.updateMatrixWorld(true);
const box = new THREE.Box3();
let triangles = 0;
scene.traverse((object) => {
  const geometry = object.geometry;
  if (!geometry || !object.visible || object.material?.side === THREE.BackSide && object.material.fog === false) return;
  box.expandByObject(object, true);
  if (object.isMesh) triangles += (geometry.index ?? geometry.attributes.position).count / 3;
});
const answer = { min: box.min.toArray(), max: box.max.toArray() };
process.stdout.write(JSON.stringify({ box: box.isEmpty() ? null : answer, triangles, messages }) + "\n");
