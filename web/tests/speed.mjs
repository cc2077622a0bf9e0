// Compares the page's program with the native one on one thread with the same arithmetic: `node tests/speed.mjs
// DIST PROGRAM`. Prints processor seconds of rendering, the least of three runs in turn; the page's program is warm.
import { execFileSync } from 'node:child_process';
import { readFileSync, readdirSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { System, Tree } from '../page/files.js';

const SCENES = [
    ['livroom/livroom.iv', '--lens', 'nikkor-28', '--efl', '24mm'],
    ['desk-lamp/desk-lamp.iv', '--efl', '20mm'],
    ['pavilion.wrl', '--lens', 'tessar', '--efl', '55mm'],
];
const [dist, program] = process.argv.slice(2);
const scenes = join(dist, 'scenes');
const tree = new Tree();
for (const path of readdirSync(scenes, { recursive: true, withFileTypes: true })) {
    const file = join(path.parentPath ?? path.path, path.name);
    if (path.isFile()) {
        tree.write(file.slice(scenes.length), new Uint8Array(readFileSync(file)));
    }
}
const page = await new System(tree, () => {}).start(await WebAssembly.compile(readFileSync(join(dist, 'ivcam.wasm'))));
const seconds = () => process.cpuUsage().user / 1e6;

function inPage(words) {
    tree.write('/.page/words', new TextEncoder().encode(['ivcam', 'render', ...words, '--arithmetic', 'portable'].join('\0')));
    tree.write('/.page/sums', new Uint8Array(0));
    if (page.ivcam_open() !== 0) {
        throw new Error(`${words} cannot be opened`);
    }
    const start = seconds();
    page.ivcam_expose(0, 0, 360, 240, 16);
    return seconds() - start;
}

function native(words) {
    const report = join(tmpdir(), `ivcam-speed-${process.pid}.json`);
    const all = ['render', ...words, '--arithmetic', 'portable', '--threads', '1', '--quiet', '--force', '--report', report, '-o', `${report}.png`];
    execFileSync(program, all, { cwd: scenes, stdio: 'ignore' });
    return JSON.parse(readFileSync(report)).processor_seconds;
}

for (const words of SCENES) {
    inPage(words);
    const runs = Array.from({ length: 3 }, () => [inPage(words), native(words)]);
    const [own, other] = [0, 1].map((i) => Math.min(...runs.map((run) => run[i])));
    console.log(`| ${words.join(' ')} | ${other.toFixed(2)} | ${own.toFixed(2)} | ${(own / other).toFixed(1)} |`);
}
