// Tests the pages of a catalog in Chromium, from the file system and from a server below a sub-path:
// `node tests/catalog.js CATALOG`, where CATALOG is the folder that `ivcam catalog FOLDER -o CATALOG` made of three
// scenes with pictures or more. With `--page` the first scene is opened live too. IVCAM_SCREENSHOTS names a folder for
// pictures of the pages. Needs playwright-core.
const assert = require('node:assert');
const { existsSync, readFileSync } = require('node:fs');
const { join, resolve } = require('node:path');
const { pathToFileURL } = require('node:url');
const { chromium } = require('playwright-core');
const { serve } = require('./server.js');

const catalog = resolve(process.argv[2]);
const data = JSON.parse(readFileSync(join(catalog, 'catalog.json'), 'utf8'));
const pictured = data.scenes.filter((scene) => scene.picture);
const shots = process.env.IVCAM_SCREENSHOTS;
const ARGUMENTS = ['--no-sandbox', '--disable-gpu', '--disable-background-networking', '--disable-component-update',
    '--disable-sync', '--no-first-run'];
let browser;

/** Opens a page. Everything that it loads, and every fault, is recorded. */
async function open(address, width, colorScheme = 'light', options = {}) {
    const context = await browser.newContext({ viewport: { width, height: 900 }, colorScheme, ...options });
    const page = await context.newPage();
    page.faults = [];
    page.loaded = [];
    page.on('pageerror', (error) => page.faults.push(String(error)));
    // A browser asks a server for an icon by itself.
    const isIcon = (line) => line.location().url.endsWith('/favicon.ico');
    page.on('console', (line) => line.type() === 'error' && !isIcon(line) && page.faults.push(line.text()));
    page.on('dialog', (dialog) => page.faults.push(`a dialog: ${dialog.message()}`) && dialog.dismiss());
    page.on('request', (request) => page.loaded.push(request.url()));
    page.on('requestfailed', (request) => page.faults.push(`${request.url()} is not loaded`));
    await page.goto(address);
    return page;
}

const shown = (page) => page.$$eval('#scenes tbody tr:not([hidden]) .name', (names) => names.map((n) => n.textContent));

/** Nothing is wider than the window, and everything is loaded from the folder of the catalog. */
async function fits(page, home) {
    const wide = await page.evaluate(() => [...document.querySelectorAll('body *')]
        .filter((e) => e.offsetWidth > 0 && e.getBoundingClientRect().right > innerWidth + 1)
        .map((e) => `${e.tagName}.${e.className}`).slice(0, 5));
    assert.deepEqual(wide, [], 'elements beyond the right edge');
    assert.equal(await page.evaluate(() => document.documentElement.scrollWidth), page.viewportSize().width);
    assert.deepEqual(page.loaded.filter((address) => !address.startsWith(home)), []);
    assert.deepEqual(page.faults, []);
}

async function shot(page, name) {
    if (shots) {
        await page.waitForTimeout(300);
        await page.screenshot({ path: join(shots, `${name}.png`) });
    }
}

async function views(page) {
    const layout = () => page.$eval('#scenes tbody', (body) => getComputedStyle(body).display);
    assert.equal(await layout(), 'grid');
    await page.click('#views [data-view="list"]');
    assert.notEqual(await layout(), 'grid');
    assert.equal(await page.getAttribute('#views [data-view="list"]', 'aria-pressed'), 'true');
    await page.reload();
    assert.notEqual(await layout(), 'grid', 'the view is kept');
}

async function viewer(page) {
    const name = () => page.textContent('#viewer-name');
    const isOpen = () => page.$eval('#viewer', (dialog) => dialog.open);
    await page.focus('a[data-view] >> nth=0');
    await page.keyboard.press('Enter');
    assert(await isOpen());
    await page.waitForFunction(() => document.getElementById('large').naturalWidth > 0);
    const first = await name();
    const large = await page.$eval('#large', (image) => image.naturalWidth);
    const small = await page.$eval('a[data-view] img', (image) => image.naturalWidth);
    assert.equal(large, 3 * small);
    const box = await (await page.$('#viewer')).boundingBox();
    assert(box.x >= 0 && box.x + box.width <= page.viewportSize().width && box.height <= 901, 'the viewer fits the window');
    await page.keyboard.press('ArrowRight');
    assert.notEqual(await name(), first);
    await page.keyboard.press('ArrowLeft');
    await page.keyboard.press('ArrowLeft');
    assert.equal(await name(), first, 'the first has none before it');
    assert(await page.isDisabled('#previous'));
    await page.keyboard.press('Escape');
    assert(!(await isOpen()));
    assert.equal(await page.evaluate(() => document.activeElement.closest('tr')?.querySelector('.name').textContent), first,
        'the focus returns');
    await page.click('a[data-view] >> nth=1');
    const second = await name();
    await page.click('#viewer-page');
    await page.waitForSelector('body.one');
    assert.equal(await page.textContent('h1'), second, 'the link leads to the page of the scene');
    await page.goBack();
}

async function filters(page) {
    for (const label of await page.$$('#labels button')) {
        const count = Number((await label.textContent()).match(/\d+/)[0]);
        await label.click();
        assert.equal((await shown(page)).length, count);
        await label.click();
    }
    const scene = pictured.find(({ classes }) => Object.keys(classes.drawn ?? {}).length > 0);
    await page.fill('#filter', Object.keys(scene.classes.drawn)[0]);
    assert((await shown(page)).includes(scene.file), 'a class of nodes finds the scene');
    await page.fill('#filter', '');
    await page.selectOption('#order', { label: 'Size, largest first' });
    const sizes = await page.$$eval('#scenes td[data-heading="Size"]', (cells) => cells.map((cell) => Number(cell.dataset.value)));
    assert.deepEqual(sizes, [...sizes].sort((a, b) => b - a));
    await page.selectOption('#order', { label: 'Scene, A to Z' });
}

/** The page of every scene, or of some of many, opens and shows what the data have. */
async function scenePages(home, width, colorScheme) {
    const few = data.scenes.filter((_, i) => i % Math.ceil(data.scenes.length / 12) === 0);
    const address = (file) => `${home}scenes/${file.split('/').map(encodeURIComponent).join('/')}.html`;
    for (const scene of few) {
        const page = await open(address(scene.file), width, colorScheme);
        // Characters that turn the direction of text are not on the page.
        const plain = (text) => text.replace(/[\u200e\u200f\u202a-\u202e\u2066-\u2069]/g, '').replace(/[\x00-\x1f\x7f]/g, ' ');
        assert.equal(await page.textContent('h1'), plain(scene.file));
        assert((await page.textContent('dl')).includes(scene.sha256));
        const hasPicture = await page.$eval('main', (main) => main.querySelector('img')?.naturalWidth > 0);
        assert.equal(hasPicture, Boolean(scene.picture));
        assert.equal(await page.$$eval('.tree details[open]', (open) => open.length), 0, 'the tree is folded');
        await page.$$eval('.tree details', (all) => all.forEach((details) => { details.open = true; }));
        await fits(page, home);
        await page.context().close();
    }
}

async function live(home) {
    const page = await open(`${home}index.html`, 1280);
    const [scene] = pictured;
    const row = page.locator('#scenes tbody tr', { has: page.locator('.name', { hasText: scene.file }) }).first();
    await row.locator('a.live').click();
    await page.waitForFunction(() => document.body.dataset.finished, undefined, { timeout: 180_000 });
    assert.equal(await page.evaluate(() => document.body.dataset.finished), 'yes');
    assert.doesNotMatch(await page.textContent('#messages'), /not found|cannot be loaded/);
    await shot(page, 'live');
    assert.deepEqual(page.faults, []);
    console.log(`live: ${scene.file}: ${await page.textContent('#status')}`);
    await page.context().close();
}

async function main() {
    browser = await chromium.launch({ executablePath: process.env.CHROMIUM || '/usr/bin/chromium', args: ARGUMENTS });
    const server = await serve(catalog);
    const homes = { file: `${pathToFileURL(catalog).href}/`, server: server.address };
    for (const [kind, home] of Object.entries(homes)) {
        for (const width of [360, 600, 900, 1280, 2000]) {
            for (const scheme of ['light', 'dark']) {
                const page = await open(`${home}index.html`, width, scheme);
                await shot(page, `${kind}-${width}-${scheme}-grid`);
                await fits(page, home);
                await views(page);
                await shot(page, `${kind}-${width}-${scheme}-list`);
                await fits(page, home);
                await filters(page);
                await viewer(page);
                await page.click('a[data-view] >> nth=0');
                await shot(page, `${kind}-${width}-${scheme}-viewer`);
                await page.context().close();
                await scenePages(home, width, scheme);
                console.log(`${kind}, ${width} pixels, ${scheme}: views, filters, viewer and the pages of scenes are right`);
            }
        }
    }
    const page = await open(`${homes.file}index.html`, 900, 'light', { javaScriptEnabled: false });
    assert.equal((await page.$$('#scenes tbody tr')).length, data.scenes.length);
    assert.equal(await page.isVisible('#controls'), false);
    await fits(page, homes.file);
    console.log('without scripts: all scenes are in the list');
    if (existsSync(join(catalog, 'page/ivcam.wasm'))) {
        await live(homes.server);
    }
    server.end();
    await browser.close();
}

main().catch((error) => {
    console.error(error);
    process.exit(1);
});
