// Lists the files of a built page: those of each scene, and all for use without a network.
const { createHash } = require('node:crypto');
const { readFileSync, readdirSync, writeFileSync } = require('node:fs');
const { dirname, join } = require('node:path');

const out = process.argv[2];
const below = (folder) => readdirSync(join(out, folder), { withFileTypes: true }).flatMap((entry) => {
    const path = folder === '' ? entry.name : `${folder}/${entry.name}`;
    return entry.isDirectory() ? below(path) : [path];
});

const all = below('').filter((path) => path !== 'offline.js').sort();
const scenes = JSON.parse(readFileSync(join(__dirname, 'scenes/scenes.json'), 'utf8'));
for (const scene of scenes) {
    const folder = dirname(scene.scene);
    const files = folder === '.' ? [scene.scene] : below(`scenes/${folder}`).map((path) => path.slice(7));
    scene.files = files.sort();
}
writeFileSync(join(out, 'scenes.json'), JSON.stringify(scenes));

const hash = createHash('sha256');
const kept = ['./', 'scenes.json', ...all.filter((path) => path !== 'scenes.json')];
kept.slice(1).forEach((path) => hash.update(path).update(readFileSync(join(out, path))));
const worker = readFileSync(join(out, 'offline.js'), 'utf8')
    .replace("'VERSION'", JSON.stringify(`ivcam ${hash.digest('hex').slice(0, 16)}`))
    .replace("['FILES']", JSON.stringify(kept));
writeFileSync(join(out, 'offline.js'), worker);
