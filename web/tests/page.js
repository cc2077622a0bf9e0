// Tests a built page in Chromium: `node tests/page.js DIST PROGRAM [FILE …]`. Pictures are compared with those
// of the program, to the bit, for the repository's scenes and for each FILE, which is a scene with what lies in
// its folder. IVCAM_SCREENSHOTS names a folder for pictures of the page.
const assert = require('node:assert');
const { execFileSync } = require('node:child_process');
const { cpSync, existsSync, mkdtempSync, readFileSync, readdirSync, rmSync, statSync, writeFileSync } = require('node:fs');
const { tmpdir } = require('node:os');
const { basename, dirname, join } = require('node:path');
const { chromium } = require('playwright-core');
const { serve } = require('./server.js');
const { ppm, zipped } = require('./files.js');

const [dist, program, ...others] = process.argv.slice(2);
const root = join(__dirname, '../..');
const shots = process.env.IVCAM_SCREENSHOTS;
const BROWSERS = ['/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome'];
const ARGUMENTS = ['--no-sandbox', '--disable-gpu', '--disable-background-networking', '--disable-component-update',
    '--disable-sync', '--no-first-run'];
let browser, server, count = 0;

/** Opens the page, with the desk lamp in a small picture unless another scene is asked for. */
async function open(options = {}, search = '?scene=2&samples=4&size=180') {
    const page = await visit(options, search);
    await finished(page);
    return page;
}

/** Visits the page. `prepare` gets it before. */
async function visit(options, search, prepare = async () => {}) {
    const context = await browser.newContext({ viewport: { width: 1280, height: 1000 }, acceptDownloads: true, ...options });
    const page = await context.newPage();
    page.faults = [];
    page.on('pageerror', (error) => page.faults.push(String(error)));
    page.on('console', (line) => line.type() === 'error' && page.faults.push(line.text()));
    page.on('dialog', (dialog) => page.faults.push(`a dialog: ${dialog.message()}`) && dialog.dismiss());
    await prepare(page);
    await page.goto(server.address + search);
    return page;
}

/** Waits until the picture is finished. Returns `yes` or `failed`. */
async function finished(page, timeout = 180_000) {
    await page.waitForFunction(() => document.body.dataset.finished, undefined, { timeout });
    return page.evaluate(() => document.body.dataset.finished);
}

/** Changes something, and waits for the new picture. */
async function changed(page, change) {
    await page.evaluate(() => delete document.body.dataset.finished);
    await change();
    return finished(page);
}

/** The pixels of the canvas, without alpha. */
async function pixels(page) {
    const list = await page.evaluate(() => {
        const { width, height } = document.getElementById('picture');
        const { data } = document.getElementById('picture').getContext('2d').getImageData(0, 0, width, height);
        return btoa(data.reduce((text, byte) => text + String.fromCharCode(byte), ''));
    });
    return Buffer.from(list, 'base64').filter((_, i) => i % 4 !== 3);
}

const text = (page, id) => page.evaluate((id) => document.getElementById(id).textContent, id);

/** Runs the command line that the page shows, in a folder. Returns the picture. */
function made(line, folder) {
    const to = join(mkdtempSync(join(tmpdir(), 'ivcam-page-')), 'made.ppm');
    const words = line.replace(/ -o (\S+|'[^']*')$/, '').replace(/^ivcam /, '');
    execFileSync('bash', ['-c', `"$0" ${words} --quiet -o "$1"`, program, to], { cwd: folder, stdio: ['ignore', 'ignore', 'ignore'] });
    const picture = ppm(to);
    rmSync(dirname(to), { recursive: true });
    return picture;
}

/** Compares the picture on the page with that of the command line on the page. */
async function isProgram(page, folder) {
    const line = await text(page, 'command');
    const [own, other] = [await pixels(page), made(line, folder)];
    assert.equal(own.length, other.rgb.length, `the size of ${line}`);
    const different = own.filter((byte, i) => byte !== other.rgb[i]).length;
    assert.equal(different, 0, `${different} bytes differ from those of ${line}`);
    return line;
}

async function shot(page, name) {
    if (shots) {
        await page.screenshot({ path: join(shots, `${name}.png`), fullPage: true });
    }
}

function scratch(files) {
    const folder = mkdtempSync(join(tmpdir(), 'ivcam-page-'));
    files.forEach(([name, content]) => writeFileSync(join(folder, name), content));
    return folder;
}

const BOOK = ['book.iv', 'book-cover.png', 'book-spine.png', 'pages.png'];
const book = () => BOOK.map((name) => [name, readFileSync(join(root, 'scenes/livroom', name))]);
const opens = (page, id, files) => changed(page, () => page.setInputFiles(`#${id}`, files));

const tests = {
    async 'the scenes of the page have the bits of the program, and so has a changed camera'(first) {
        await first.goto(server.address);
        const page = first;
        await finished(page);
        const scenes = join(dist, 'scenes');
        await isProgram(page, scenes);
        const times = await page.evaluate(() => ({ ...document.body.dataset }));
        console.log(`      living room: first picture after ${times.first} ms; ${await text(page, 'status')}`);
        await shot(page, 'room');
        await page.focus('#picture');
        await changed(page, () => page.keyboard.press('ArrowLeft'));
        const preview = await page.evaluate(() => document.body.dataset.preview);
        console.log(`      first reaction to a turn of the camera after ${preview} ms`);
        const [saved] = await Promise.all([page.waitForEvent('download'), page.evaluate(() => {
            document.getElementById('command-box').open = true;
            document.getElementById('copy-camera').click();
        })]);
        await saved.saveAs(join(scenes, 'page-camera.iv'));
        try {
            assert.match(await isProgram(page, scenes), /--camera page-camera\.iv/);
        } finally {
            rmSync(join(scenes, 'page-camera.iv'));
        }
        for (const scene of ['shipped 1', 'shipped 2']) {
            await changed(page, () => page.selectOption('#scenes', scene));
            await isProgram(page, scenes);
        }
        await changed(page, () => page.selectOption('#view', 'bind Above'));
        assert.match(await isProgram(page, scenes), /Above\.set_bind/);
        await shot(page, 'world');
    },

    async 'a folder with textures, a .zip of it and single files give the same picture'(page) {
        const folder = scratch(book());
        await opens(page, 'folder', folder);
        const line = await isProgram(page, dirname(folder));
        assert.match(line, /book\.iv/);
        const first = await pixels(page);
        const zip = join(scratch([['book.zip', zipped(book())]]), 'book.zip');
        await opens(page, 'files', zip);
        assert.ok((await pixels(page)).equals(first));
        await opens(page, 'files', BOOK.map((name) => join(folder, name)));
        assert.ok((await pixels(page)).equals(first));
        const lone = await opens(page, 'files', join(folder, 'book.iv'));
        assert.equal(lone, 'yes');
        assert.match(await text(page, 'messages'), /book-cover\.png` was not found/);
        assert.ok(!(await pixels(page)).equals(first));
        await shot(page, 'folder');
    },

    async 'of many scenes the one that no other names comes first, at once'(page) {
        const [first, seconds] = await page.evaluate(async () => {
            const { sorted } = await import('./opened.js');
            const bytes = (text) => new TextEncoder().encode(`#Inventor V2.1 ascii\n${text}\n${'# filler\n'.repeat(8000)}`);
            const files = new Map(Array.from({ length: 300 }, (_, i) => [`all/a${i}.iv`, bytes(`File { name "a${i + 1}.iv" }`)]));
            files.set('all/z.iv', bytes('File { name "a0.iv" } # "z.iv"'));
            const start = performance.now();
            return [sorted(files).scenes[0], (performance.now() - start) / 1000];
        });
        assert.equal(first, 'all/z.iv');
        assert.ok(seconds < 5, `${seconds} s`);
    },

    async 'a texture goes into the folder of the scene'(page) {
        const folder = scratch(book());
        await opens(page, 'folder', folder);
        const whole = await pixels(page);
        rmSync(join(folder, 'book-cover.png'));
        await opens(page, 'folder', folder);
        assert.match(await text(page, 'messages'), /book-cover\.png` was not found/);
        await opens(page, 'files', join(root, 'scenes/livroom/book-cover.png'));
        assert.doesNotMatch(await text(page, 'messages'), /not found/);
        assert.ok((await pixels(page)).equals(whole));
    },

    async 'a damaged file is drawn as far as it goes, and the place of the damage is reported'(page) {
        const bad = '#Inventor V2.1 ascii\nSeparator {\n  Material { diffuseColour 1 0 0 }\n  Cone { height x }\n  Sphere { }\n}\n';
        await opens(page, 'files', join(scratch([['bad.iv', bad]]), 'bad.iv'));
        assert.match(await text(page, 'messages'), /bad\.iv:3:\d+/);
        await isProgram(page, dirname(join(scratch([['bad.iv', bad]]), 'bad.iv')));
        const cut = readFileSync(join(root, 'scenes/livroom/book.iv')).subarray(0, 900);
        await opens(page, 'files', join(scratch([['cut.iv', cut]]), 'cut.iv'));
        assert.match(await text(page, 'messages'), /cut\.iv:\d+:\d+/);
        const broken = zipped(book()).subarray(0, 3000);
        await page.setInputFiles('#files', join(scratch([['cut.zip', broken]]), 'cut.zip'));
        await page.waitForFunction(() => /No scene/.test(document.getElementById('status').textContent));
        assert.match(await text(page, 'messages'), /cut\.zip cannot be unpacked/);
    },

    async 'lenses that are opened one after the other stay in the list'(page) {
        const lens = readFileSync(join(root, 'lenses/telephoto/telephoto.dat'));
        const folder = scratch([['one.dat', lens], ['two.dat', lens]]);
        for (const name of ['one.dat', 'two.dat']) {
            await opens(page, 'files', join(folder, name));
        }
        const opened = await page.evaluate(() => [...document.querySelectorAll('#lens optgroup[label="opened"] option')].map((o) => o.value));
        assert.deepEqual(opened, ['desk-lamp/two.dat', 'desk-lamp/one.dat']);
        assert.match(await text(page, 'command'), /--lens desk-lamp\/two\.dat/);
    },

    async 'a report beside a scene is no lens, and a lens as JSON is one'(page) {
        const [file] = await Promise.all([page.waitForEvent('download'), page.click('[data-end="report.json"]')]);
        const report = join(scratch([]), 'room.report.json');
        await file.saveAs(report);
        const cube = join(scratch([['cube.iv', '#Inventor V2.1 ascii\nPerspectiveCamera { position 0 0 6 } Cube { }\n']]), 'cube.iv');
        assert.equal(await opens(page, 'files', [cube, report]), 'yes');
        assert.doesNotMatch(await text(page, 'command'), /--lens \S*json/);
        await opens(page, 'files', [cube, join(root, 'lenses/phone/phone.json')]);
        assert.match(await text(page, 'command'), /--lens phone\.json/);
    },

    async 'a damaged file of a .zip is reported, and the others are read'(page) {
        const zip = zipped(book());
        const stored = zip.indexOf(readFileSync(join(root, 'scenes/livroom/book-cover.png')));
        zip[stored + 2000] ^= 1;
        await opens(page, 'files', join(scratch([['one.zip', zip]]), 'one.zip'));
        assert.match(await text(page, 'messages'), /damaged: book-cover\.png in one\.zip is not what was packed: its checksum differs/);
        const packed = zip.indexOf('book-spine.png') + 'book-spine.png'.length;
        zip.fill(255, packed, packed + 10);
        await opens(page, 'files', join(scratch([['two.zip', zip]]), 'two.zip'));
        assert.match(await text(page, 'messages'), /damaged: book-spine\.png in two\.zip is not read/);
        assert.match(await text(page, 'command'), /render book\.iv/);
    },

    async 'archives of other systems are read, and of two files with one path it is said which is not'(page) {
        const cube = (size) => Buffer.from(`#Inventor V2.1 ascii\nPerspectiveCamera { position 0 0 6 } Cube { width ${size} }\n`);
        const own = [['room\\a.iv', cube(1)], ['__MACOSX/room/._a.iv', cube(2)], ['room/._b.iv', cube(3)], ['.page/words', cube(4)]];
        const folder = scratch([['one.zip', zipped(own)], ['two.zip', zipped([['room/a.iv', cube(5)]])]]);
        await opens(page, 'files', ['one.zip', 'two.zip'].map((name) => join(folder, name)));
        const scenes = await page.evaluate(() => [...document.querySelectorAll('#scenes optgroup[label="Opened"] option')].map((o) => o.value));
        assert.deepEqual(scenes, ['room/a.iv']);
        const messages = await text(page, 'messages');
        assert.match(messages, /room\/a\.iv in two\.zip is not read: another file/);
        assert.match(messages, /\.page\/words in one\.zip is not read/);
        assert.doesNotMatch(messages, /_b\.iv/);
    },

    async 'a camera goes beside the scene, and files of every format are scenes'(page) {
        const cube = '#Inventor V2.1 ascii\nPerspectiveCamera { position 0 0 6 } Cube { }\n';
        await opens(page, 'files', join(scratch([['cube.iv', cube]]), 'cube.iv'));
        await opens(page, 'files', join(root, 'camera/cam-1.dat'));
        assert.match(await text(page, 'command'), /render cube\.iv .*--camera/);
        const box = '<X3D profile="Interchange" version="3.3"><Scene><Shape><Box/></Shape></Scene></X3D>';
        await opens(page, 'files', join(scratch([['box.x3d', box]]), 'box.x3d'));
        assert.match(await text(page, 'command'), /render box\.x3d/);
    },

    async 'another scene of the list gets the focal length of its own camera'(page) {
        const seen = (angle) => `#Inventor V2.1 ascii\nPerspectiveCamera { position 0 0 6 heightAngle ${angle} } Cube { }\n`;
        const folder = scratch([['a-tele.iv', seen(0.05)], ['b-wide.iv', seen(1)]]);
        await opens(page, 'files', ['a-tele.iv', 'b-wide.iv'].map((name) => join(folder, name)));
        const tele = Number(await page.inputValue('#efl'));
        await changed(page, () => page.selectOption('#scenes', 'b-wide.iv'));
        const wide = Number(await page.inputValue('#efl'));
        assert.ok(tele > 100 && wide < 30, `${tele} mm, then ${wide} mm`);
    },

    async 'the camera of the page is no file of the scene'(page) {
        const cube = '#Inventor V2.1 ascii\nPerspectiveCamera { position 0 0 6 } Cube { }\n';
        const folder = scratch([['camera.iv', cube], ['page-camera.iv', cube]]);
        await opens(page, 'files', join(folder, 'camera.iv'));
        const first = await pixels(page);
        await page.focus('#picture');
        await changed(page, () => page.keyboard.press('ArrowLeft'));
        assert.ok(!(await pixels(page)).equals(first));
        await changed(page, () => page.click('#home'));
        assert.ok((await pixels(page)).equals(first));
        await opens(page, 'files', ['camera.iv', 'page-camera.iv'].map((name) => join(folder, name)));
        await page.focus('#picture');
        await changed(page, () => page.keyboard.press('ArrowLeft'));
        assert.match(await text(page, 'command'), /--camera page-camera-2\.iv/);
    },

    async 'a hostile file stays in its worker, and the page goes on'(page) {
        const names = '#Inventor V2.1 ascii\nDEF <img/src=x/onerror=alert(1)> Separator { Label { label "</pre><script>alert(2)</script>" }\n'
            + '  Material { <img> 3 } Sphere { } File { name "no</pre><b>.iv" } }\n';
        await opens(page, 'files', join(scratch([['<img src=x onerror=alert(3)>.iv', names]]), '<img src=x onerror=alert(3)>.iv'));
        assert.match(await text(page, 'messages'), /no<\/pre><b>\.iv` was not found/);
        assert.match(await text(page, 'messages'), /no field `<img>`/);
        assert.equal(await page.evaluate(() => document.querySelectorAll('b, pre img, pre script').length), 0);
        const level = (i) => `DEF L${i} Group { ${'USE L' + (i - 1) + ' '} Group { USE L${i - 1} } USE L${i - 1} USE L${i - 1} }`;
        const bomb = `#Inventor V2.1 ascii\nDEF L0 Separator { Cube { } }\n${Array.from({ length: 40 }, (_, i) => level(i + 1)).join('\n')}\n`;
        await opens(page, 'files', join(scratch([['bomb.iv', bomb]]), 'bomb.iv'));
        console.log(`      a file of 4^40 cubes: ${(await text(page, 'status'))}`);
        const deep = `#Inventor V2.1 ascii\n${'Group { '.repeat(400_000)}`;
        await opens(page, 'files', join(scratch([['deep.iv', deep]]), 'deep.iv'));
        await opens(page, 'files', join(root, 'scenes/desk-lamp/desk-lamp.iv'));
        const big = await changed(page, () => page.fill('#more', '--size 9000x9000 --memory 900GB --samples 1'));
        assert.equal(big, 'failed');
        assert.match(await text(page, 'messages'), /needs 8\.6 GB of memory/);
        const lost = await changed(page, async () => {
            await page.fill('#more', '--samples 4096');
            await page.waitForTimeout(1500);
            const breaks = (worker) => worker.evaluate(() => setTimeout(() => { throw new Error('broken'); })).catch(() => {});
            await Promise.all(page.workers().map(breaks));
        });
        assert.equal(lost, 'failed');
        assert.match(await text(page, 'status'), /ended its worker: .*broken/);
        await page.evaluate(() => { document.getElementById('more').value = ''; });
        await changed(page, () => page.selectOption('#scenes', 'shipped 1'));
        await isProgram(page, join(dist, 'scenes'));
    },

    async 'what is saved is complete'(page) {
        const wanted = { png: '\x89PNG', exr: 'v/1\x01', glb: 'glTF', x3d: '<?xml', wrl: '#VRML V2.0', iv: '#Inventor', 'losses.json': '{', 'lens.html': '<!', 'report.json': '{' };
        for (const [end, start] of Object.entries(wanted)) {
            const [file] = await Promise.all([page.waitForEvent('download'), page.click(`[data-end="${end}"]`)]);
            const bytes = readFileSync(await file.path());
            assert.ok(bytes.toString('latin1').trimStart().startsWith(start), `${end} begins with ${bytes.subarray(0, 16)}`);
            if (end === 'report.json') {
                const report = JSON.parse(bytes);
                assert.equal(report.picture, 'desk-lamp.png');
                assert.ok(report.total_seconds >= report.seconds.read && report.total_seconds < 180);
            }
        }
    },

    async 'the data sheet is that of the lens in the picture'(page) {
        await changed(page, () => page.fill('#more', '--lens tessar --efl 100mm'));
        const [file] = await Promise.all([page.waitForEvent('download'), page.click('[data-end="lens.html"]')]);
        assert.equal(file.suggestedFilename(), 'tessar.html');
        assert.match(readFileSync(await file.path(), 'utf8'), /tessar[^]*100(\.0+)? mm/i);
        await changed(page, () => page.fill('#more', '--lens none'));
        await page.click('[data-end="lens.html"]');
        await page.waitForFunction(() => /without a prescription/.test(document.getElementById('saved').textContent));
    },

    async 'lenses are found by words, and a control at work drops the picture before'(page) {
        await page.fill('#search', 'fish 180');
        assert.deepEqual(await page.evaluate(() => [...document.querySelectorAll('#lens option')].map((o) => o.value)), ['nikkor-16']);
        await changed(page, () => page.selectOption('#lens', 'nikkor-16'));
        await page.fill('#search', '');
        await page.waitForFunction(() => document.getElementById('section').alt.includes('nikkor-16'));
        await changed(page, () => page.fill('#efl', '16'));
        await changed(page, async () => {
            await page.selectOption('#samples', '1024');
            await page.waitForTimeout(600);
            await page.selectOption('#samples', '16');
        });
        assert.match(await isProgram(page, join(dist, 'scenes')), /nikkor-16.*--aperture/);
        await shot(page, 'fisheye');
    },

    async 'a click focuses on what is under it, and the wheel moves the focus'(page) {
        const box = await page.locator('#picture').boundingBox();
        await changed(page, () => page.mouse.click(box.x + box.width / 2, box.y + box.height * 0.6));
        const near = Number(await page.inputValue('#focus'));
        assert.ok(near > 0.1 && near < 20, `${near} m`);
        await changed(page, () => page.mouse.wheel(0, -100));
        assert.ok(Number(await page.inputValue('#focus')) > near);
        await isProgram(page, join(dist, 'scenes'));
    },

    async 'a focus that comes too early is said to be that'(page) {
        const said = await page.evaluate(async () => {
            const all = [];
            new MutationObserver(() => all.push(document.getElementById('status').textContent))
                .observe(document.getElementById('status'), { childList: true });
            document.getElementById('home').click();
            await new Promise((go) => setTimeout(go, 20));
            document.getElementById('middle').click();
            await new Promise((go) => setTimeout(go, 20));
            return all.join(' | ');
        });
        assert.match(said, /not open yet/);
        assert.doesNotMatch(said, /Nothing is there/);
        await finished(page);
    },

    async 'a stop in the pause after a change holds'(page) {
        await page.evaluate(() => {
            const more = document.getElementById('more');
            more.value = '--seed 3';
            more.dispatchEvent(new Event('input'));
            document.getElementById('stop').click();
        });
        await page.waitForTimeout(2000);
        assert.match(await text(page, 'status'), /^Stopped/);
        assert.ok(await page.isDisabled('#stop'));
    },

    async 'what is seen after a stop is what is saved, with its samples and error'(page) {
        await page.selectOption('#samples', '1024');
        await page.waitForFunction(() => !document.querySelector('[data-end="png"]').disabled && document.getElementById('progress').value > 0.03);
        await page.click('#stop');
        await page.waitForTimeout(1000);
        assert.match(await text(page, 'status'), /^Stopped: \d+ of 1024 samples, error [\d.]+%, /);
        const [file] = await Promise.all([page.waitForEvent('download'), page.click('[data-end="png"]')]);
        const saved = await page.evaluate(async (text) => {
            const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
            const image = await createImageBitmap(new Blob([bytes]));
            const canvas = Object.assign(document.createElement('canvas'), { width: image.width, height: image.height });
            canvas.getContext('2d').drawImage(image, 0, 0);
            const { data } = canvas.getContext('2d').getImageData(0, 0, image.width, image.height);
            return btoa(data.reduce((text, byte) => text + String.fromCharCode(byte), ''));
        }, readFileSync(await file.path()).toString('base64'));
        const rgb = Buffer.from(saved, 'base64').filter((_, i) => i % 4 !== 3);
        assert.ok((await pixels(page)).equals(rgb), 'the picture that is saved is another');
    },

    async 'the command line is copied without the interface of secure pages too'(page) {
        await page.evaluate(() => {
            Object.defineProperty(navigator, 'clipboard', { value: undefined });
            document.addEventListener('copy', () => { document.body.dataset.copied = String(getSelection()); });
            document.getElementById('command-box').open = true;
        });
        await page.click('#copy');
        assert.equal(await page.evaluate(() => document.body.dataset.copied), await text(page, 'command'));
    },

    async 'a screen reader is not interrupted by every band'(page) {
        await page.evaluate(() => {
            window.spoken = [];
            const watch = new MutationObserver(() => window.spoken.push(document.getElementById('spoken').textContent));
            watch.observe(document.getElementById('spoken'), { childList: true });
        });
        const start = Date.now();
        await changed(page, () => page.selectOption('#samples', '64'));
        const spoken = await page.evaluate(() => window.spoken);
        assert.ok(spoken.length <= 3 + (Date.now() - start) / 10_000, spoken.join(' | '));
        assert.match(spoken.at(-1), /^64 of 64 samples/);
        const live = await page.evaluate(() => [...document.querySelectorAll('[aria-live="polite"], [role="status"]')].map((e) => e.id));
        assert.deepEqual(live, ['spoken', 'saved']);
    },

    async 'help that is asked for among the options is shown'(page) {
        assert.equal(await changed(page, () => page.fill('#more', '--help')), 'failed');
        assert.match(await text(page, 'messages'), /--aperture/);
    },

    async 'a file that is not read is named'(page) {
        await opens(page, 'files', join(scratch([['triangle.usda', '#usda 1.0\n']]), 'triangle.usda'));
        assert.match(await text(page, 'messages'), /desk-lamp\/triangle\.usda is no scene, lens, camera or picture/);
        assert.match(await text(page, 'command'), /desk-lamp\.iv/);
    },

    async 'an old picture is compared with the new one'(page) {
        const [file] = await Promise.all([page.waitForEvent('download'), page.click('[data-end="png"]')]);
        const old = join(scratch([]), 'old.png');
        await file.saveAs(old);
        await opens(page, 'files', old);
        await page.click('#compare');
        await page.waitForFunction(() => document.getElementById('compared').textContent.length > 20);
        assert.match(await text(page, 'compared'), /PSNR|RMSE|identical/i);
    },

    async 'after the first visit the page works without a network'(page) {
        await page.evaluate(() => navigator.serviceWorker.ready);
        await page.waitForFunction(() => navigator.serviceWorker.controller !== null, undefined, { timeout: 30_000 });
        await page.context().setOffline(true);
        await page.reload();
        await finished(page);
        await isProgram(page, join(dist, 'scenes'));
        await page.context().setOffline(false);
    },
};

/** Tests with pages of their own. */
const separate = {
    async 'a phone of 380 pixels shows everything without scrolling sideways'() {
        const page = await open({ viewport: { width: 380, height: 780 }, hasTouch: true, isMobile: true, colorScheme: 'dark' });
        assert.equal(await page.evaluate(() => document.scrollingElement.scrollWidth), 380);
        const small = await page.evaluate(() => [...document.querySelectorAll('button, select')].filter((e) => e.offsetHeight > 0 && e.offsetHeight < 40).length);
        assert.equal(small, 0, 'controls are too small for a finger');
        await shot(page, 'phone');
        await changed(page, () => page.tap('#picture'));
        assert.ok(Number(await page.inputValue('#focus')) > 0);
        return page;
    },

    async 'the keyboard alone reaches and uses every control'() {
        const page = await open({ colorScheme: 'light', reducedMotion: 'reduce' });
        await shot(page, 'light');
        const reached = new Set();
        await page.focus('#scenes');
        for (let i = 0; i < 60; i++) {
            reached.add(await page.evaluate(() => document.activeElement.id || document.activeElement.dataset.end));
            await page.keyboard.press('Tab');
        }
        for (const id of ['scenes', 'choose-files', 'picture', 'lens', 'efl', 'aperture', 'focus', 'exposure', 'shading', 'studio', 'view', 'png', 'glb']) {
            assert.ok(reached.has(id), `${id} is not reached with Tab`);
        }
        await page.focus('#lens');
        await changed(page, () => page.keyboard.press('ArrowDown'));
        await page.focus('#picture');
        await changed(page, () => page.keyboard.press('Enter'));
        assert.ok(Number(await page.inputValue('#focus')) > 0);
        await changed(page, () => page.keyboard.press('+'));
        assert.match(await text(page, 'command'), /--camera/);
        const unnamed = await page.evaluate(() => [...document.querySelectorAll('input, select, button, canvas')].filter((e) =>
            !e.labels?.length && !e.textContent.trim() && !e.getAttribute('aria-label')).map((e) => e.id));
        assert.deepEqual(unnamed, [], 'controls without a name for a screen reader');
        return page;
    },

    async 'the address names a scene of the same server, and files that it needs'() {
        const list = join(dist, 'scenes/book.json');
        writeFileSync(list, JSON.stringify({ files: BOOK.slice(1).map((name) => `livroom/${name}`) }));
        try {
            const page = await open({}, '?scene=scenes/livroom/book.iv&files=scenes/book.json&samples=4&size=180');
            const line = await isProgram(page, join(dist, 'scenes/livroom'));
            assert.match(line, /book\.iv/);
            assert.doesNotMatch(await text(page, 'messages'), /not found/);
            const alone = await open({}, '?scene=scenes/livroom/book.iv&samples=4&size=180');
            assert.match(await text(alone, 'messages'), /book-cover\.png` was not found/);
            await alone.context().close();
            return page;
        } finally {
            rmSync(list);
        }
    },

    async 'what is chosen last stays, before the program is there and before another scene is'() {
        const lamp = join(root, 'scenes/desk-lamp/desk-lamp.iv');
        let page;
        for (const slow of ['**/ivcam.wasm', '**/scenes/livroom/**']) {
            let go;
            const gate = new Promise((open) => { go = open; });
            await page?.context().close();
            page = await visit({ serviceWorkers: 'block' }, '?samples=4&size=180', (page) => page.route(slow, async (route) => {
                await gate;
                await route.continue();
            }));
            await page.waitForFunction((waits) => waits || document.body.dataset.ready, slow.endsWith('wasm'));
            await page.setInputFiles('#files', lamp);
            setTimeout(go, 2000);
            await finished(page);
            await page.waitForTimeout(3000);
            assert.equal(await page.inputValue('#scenes'), 'desk-lamp.iv', slow);
            assert.match(await text(page, 'command'), /render desk-lamp\.iv/);
        }
        return page;
    },

    async 'a server that does not know the type of the program will do'() {
        const page = await visit({ serviceWorkers: 'block' }, '?scene=2&samples=4&size=180', (page) => page.route('**/ivcam.wasm', async (route) => {
            const response = await route.fetch();
            await route.fulfill({ response, headers: { ...response.headers(), 'content-type': 'application/octet-stream' } });
        }));
        assert.equal(await finished(page), 'yes');
        return page;
    },

    async 'a copy of the page is kept until its own update, which takes all files anew'() {
        let isNew = false;
        const version = (bytes, digit) => String(bytes).replace(/ivcam [0-9a-f]{16}/, `ivcam ${digit.repeat(16)}`);
        const shared = await serve(dist, { 'cache-control': 'max-age=600' }, (path, bytes) => ({
            '/other/offline.js': version(bytes, '0'),
            '/sub/offline.js': isNew ? version(bytes, '1') : bytes,
            '/sub/main.js': isNew ? `${bytes}// new` : bytes,
        })[path] ?? bytes);
        const page = await visit({}, '', async () => {});
        const kept = async () => page.evaluate(() => navigator.serviceWorker.ready.then(() => caches.keys()));
        const until = async (count, text) => {
            for (let i = 0; i < 100 && !((await kept()).length === count && (await kept()).join().includes(text)); i++) {
                await page.waitForTimeout(100);
            }
            return kept();
        };
        await page.goto(shared.address);
        await until(1, 'sub');
        await page.goto(shared.address.replace('sub', 'other'));
        assert.equal((await until(2, '000 ')).length, 2);
        await page.goto(shared.address);
        isNew = true;
        await page.evaluate(() => navigator.serviceWorker.ready.then((own) => own.update()));
        assert.equal((await until(2, '111 ')).length, 2);
        await page.waitForFunction(async () => (await caches.keys()).every((name) => !/sub/.test(name) || /1{16}/.test(name)));
        assert.match(await page.evaluate(async () => (await fetch('main.js')).text()), /\/\/ new$/);
        shared.end();
        return page;
    },

    async 'an address of another server is refused before anything is fetched'() {
        const page = await open();
        const outside = ['https://example.com/a.iv', '//example.com/a.iv', 'data:text/plain,%23Inventor', 'blob:null/1',
            'file:///etc/hostname', 'javascript:alert(1)', 'http://127.0.0.1:1/a.iv', '../a%2F..%2Fb.iv'];
        const asked = [];
        page.on('request', (request) => asked.push(request.url()));
        for (const address of outside) {
            await page.goto(`${server.address}?scene=${encodeURIComponent(address)}`);
            assert.equal(await finished(page), 'failed', address);
            assert.match(await text(page, 'status'), /not on the server|no name of a file/, address);
        }
        const home = new URL(server.address).origin;
        assert.deepEqual(asked.filter((address) => !address.startsWith(home)), []);
        return page;
    },

    async 'one worker and several make the same bits'() {
        const page = await open({}, '?workers=1&scene=3&samples=16');
        const one = await pixels(page);
        const alone = await text(page, 'status');
        const more = await open({}, '?workers=4&scene=3&samples=16');
        assert.ok((await pixels(more)).equals(one));
        console.log(`      one worker: ${alone}; four: ${await text(more, 'status')}`);
        await more.context().close();
        return page;
    },
};

/** A scene of another folder: the folder is opened, if it is small, else the file. */
async function other(page, path) {
    const folder = dirname(path);
    const size = readdirSync(folder, { withFileTypes: true }).length;
    const files = size > 60 ? [path] : readdirSync(folder).map((name) => join(folder, name)).filter((f) => statSync(f).isFile());
    await changed(page, async () => {
        await page.setInputFiles('#files', files);
        await page.waitForFunction(() => document.body.dataset.finished, undefined, { timeout: 180_000 });
        const shown = await page.inputValue('#scenes');
        if (shown !== basename(path)) {
            await page.evaluate(() => delete document.body.dataset.finished);
            await page.selectOption('#scenes', basename(path));
        }
    });
    const copy = scratch([]);
    files.forEach((file) => cpSync(file, join(copy, basename(file))));
    const line = await isProgram(page, copy);
    console.log(`      ${line}`);
}

async function run(name, test) {
    const start = Date.now();
    try {
        const page = await test();
        assert.deepEqual(page.faults, [], 'the browser reports');
        await page.context().close();
        console.log(`ok    ${name} (${((Date.now() - start) / 1000).toFixed(1)} s)`);
    } catch (error) {
        count++;
        console.log(`FAILS ${name}\n      ${error.message}`);
    }
}

async function main() {
    const executablePath = process.env.CHROMIUM ?? BROWSERS.find(existsSync);
    browser = await chromium.launch({ executablePath, args: ARGUMENTS });
    server = await serve(dist);
    const only = process.env.IVCAM_ONLY;
    const on = (test) => async () => {
        const page = await open();
        await test(page);
        return page;
    };
    for (const [name, test] of Object.entries(tests)) {
        if (!only || name.includes(only)) {
            await run(name, on(test));
        }
    }
    for (const [name, test] of Object.entries(separate)) {
        if (!only || name.includes(only)) {
            await run(name, test);
        }
    }
    for (const path of others) {
        await run(path, on((page) => other(page, path)));
    }
    await browser.close();
    server.end();
    process.exit(count > 0 ? 1 : 0);
}

main();
