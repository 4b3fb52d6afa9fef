// How three.js shows a GLB: node three.mjs THREE_FOLDER FILE FRAMES_PER_SECOND FRAME…
//
// Prints JSON: for each mesh its name, its keys, the size of its picture if it has one, and for each frame the world
// positions of its vertices, x y z after x y z, metres, y up.

import { readFileSync } from "node:fs";
import { resolve } from "node:path";
import { argv } from "node:process";
import { pathToFileURL } from "node:url";

const [folder, file, rate, ...frames] = argv.slice(2);
const part = (path) => import(pathToFileURL(resolve(folder, path)).href);
const { AnimationMixer, LoopOnce, Vector3 } = await part("build/three.module.js");
const { GLTFLoader } = await part("examples/jsm/loaders/GLTFLoader.js");

// What the loader needs of a browser: a picture, of which only the size in its PNG header counts here.
globalThis.self = globalThis;
globalThis.ProgressEvent ??= class {};
globalThis.createImageBitmap = async (blob) => {
    const header = new DataView(await blob.arrayBuffer());
    return { width: header.getUint32(16), height: header.getUint32(20), close() {} };
};

const { buffer, byteOffset, byteLength } = readFileSync(file);
const { scene, animations } = await new GLTFLoader().parseAsync(buffer.slice(byteOffset, byteOffset + byteLength), "");
const mixer = new AnimationMixer(scene);
// Not from the beginning again when a clip ends, which the last frame does.
const actions = animations.map((clip) => mixer.clipAction(clip).setLoop(LoopOnce, 1));
for (const action of actions) {
    action.clampWhenFinished = true;
}

/** The world positions of a mesh as it is now. */
function positions(mesh) {
    const found = [];
    const at = new Vector3();
    for (let index = 0; index < mesh.geometry.attributes.position.count; index += 1) {
        mesh.getVertexPosition(index, at).applyMatrix4(mesh.matrixWorld);
        found.push(at.x, at.y, at.z);
    }
    return found;
}

const meshes = [];
scene.traverse((object) => {
    if (object.isMesh) {
        const picture = object.material.map?.image;
        const size = picture ? [picture.width, picture.height] : null;
        meshes.push({ mesh: object, name: object.name, keys: Object.keys(object.morphTargetDictionary ?? {}), size, frames: [] });
    }
});
for (const frame of frames) {
    actions.forEach((action) => action.reset().play());
    mixer.setTime(frame / rate);
    scene.updateMatrixWorld(true);
    meshes.forEach((found) => found.frames.push(positions(found.mesh)));
}
console.log(JSON.stringify(meshes.map(({ mesh, ...found }) => found)));
