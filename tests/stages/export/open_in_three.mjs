import fs from 'fs';
import { createRequire } from 'module';
import { pathToFileURL } from 'url';
const require = createRequire(import.meta.url);
const [file, second] = process.argv.slice(-2);
const home = process.env.NODE_PATH + '/three/';
const open = path => import(pathToFileURL(home + path));
const { AnimationMixer, Vector3 } = await open('build/three.module.js');
const text = fs.readFileSync(file);
let root, clip;
if (file.endsWith('.bvh')) {
  const { BVHLoader } = await open('examples/jsm/loaders/BVHLoader.js');
  const found = new BVHLoader().parse(text.toString());
  [root, clip] = [found.skeleton.bones[0], found.clip];
} else {
  const { GLTFLoader } = await open('examples/jsm/loaders/GLTFLoader.js');
  const found = await new GLTFLoader().parseAsync(text.buffer.slice(text.byteOffset, text.byteOffset + text.length), '');
  [root, clip] = [found.scene, found.animations[0]];
}
const mixer = new AnimationMixer(root);
mixer.clipAction(clip).play();
mixer.setTime(+second);
root.updateMatrixWorld(true);
const posed = {};
root.traverse(each => { if (each.isBone && each.name !== 'ENDSITE') posed[each.name] = each.getWorldPosition(new Vector3()).toArray(); });
console.log('found', JSON.stringify({ posed }));
