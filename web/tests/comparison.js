// Tests the page of a comparison of folders in Chromium, from the file system:
// `node tests/comparison.js REPORT`, where REPORT is the folder that `ivcam compare NEW/ OLD/ -o REPORT` made, with
// three pairs or more. IVCAM_SCREENSHOTS names a folder for pictures of the page. Needs playwright-core.
const assert = require('node:assert');
const { readFileSync } = require('node:fs');
const { join, resolve } = require('node:path');
const { pathToFileURL } = require('node:url');
const { chromium } = require('playwright-core');

const report = resolve(process.argv[2]);
const data = JSON.parse(readFileSync(join(report, 'report.json'), 'utf8'));
const shots = process.env.IVCAM_SCREENSHOTS;
const ARGUMENTS = ['--no-sandbox', '--disable-gpu', '--disable-background-networking', '--disable-component-update',
    '--disable-sync', '--no-first-run'];
let browser;

/** Opens the page. Everything that it loads, and every fault, is recorded. */
async function open(width, colorScheme = 'light', options = {}) {
    const context = await browser.newContext({ viewport: { width, height: 900 }, colorScheme, ...options });
    const page = await context.newPage();
    page.faults = [];
    page.loaded = [];
    page.on('pageerror', (error) => page.faults.push(String(error)));
    page.on('console', (line) => line.type() === 'error' && page.faults.push(line.text()));
    page.on('request', (request) => page.loaded.push(request.url()));
    page.on('requestfailed', (request) => page.faults.push(`${request.url()} is not loaded`));
    await page.goto(pathToFileURL(join(report, 'index.html')).href);
    return page;
}

/** The names of the rows that are shown, in their order. */
const shown = (page) => page.$$eval('#scenes tbody tr:not([hidden]) .name', (names) => names.map((n) => n.textContent));

/** The values of a column of the rows that are shown. */
const values = (page, heading) => page.$$eval(
    `#scenes tbody tr:not([hidden]) td[data-heading="${heading}"]`, (cells) => cells.map((c) => c.dataset.value));

const ranked = (list, down) => list.every((value, i) => i === 0 || (down ? list[i - 1] >= value : list[i - 1] <= value));

async function sorts(page) {
    const names = data.pairs.map((pair) => pair.new);
    assert.deepEqual((await shown(page)).sort(), [...names].sort());
    const first = (list) => list.filter((value) => value !== '').map(Number);
    const ssim = await values(page, 'SSIM');
    assert(ranked(first(ssim), false), 'the worst SSIM is first');
    assert(ssim.lastIndexOf('') < ssim.findIndex((value) => value !== ''), 'pairs without a measure are before all');
    // A narrow window has no heads of columns.
    if (await page.isVisible('#scenes thead')) {
        await page.click('#scenes th:has-text("FLIP") button');
        assert(ranked(first(await values(page, 'FLIP')), true), 'the worst FLIP is first');
        await page.click('#scenes th:has-text("FLIP") button');
        assert(ranked(first(await values(page, 'FLIP')), false), 'a second click turns the order');
    }
    await page.selectOption('#order', { label: 'PSNR, worst first' });
    assert(ranked(first(await values(page, 'PSNR')), false));
    await page.selectOption('#order', { label: 'SSIM, best first' });
    assert(ranked(first(await values(page, 'SSIM')), true));
    await page.selectOption('#order', { label: 'SSIM, worst first' });
}

async function filters(page) {
    const labels = await page.$$('#labels button');
    assert(labels.length > 0);
    for (const label of labels) {
        const count = Number((await label.textContent()).match(/\d+/)[0]);
        await label.click();
        assert.equal((await shown(page)).length, count);
        assert.equal(await label.getAttribute('aria-pressed'), 'true');
        await label.click();
    }
    const name = data.pairs[0].new;
    await page.fill('#filter', name);
    assert((await shown(page)).includes(name));
    await page.fill('#filter', 'no such name');
    assert.deepEqual(await shown(page), []);
    assert.match(await page.textContent('#shown'), /^0 of \d+ shown$/);
    await page.fill('#filter', '');
}

/** The state of the picture in the viewer. */
const stage = (page) => page.evaluate(() => {
    const { dataset, style } = document.getElementById('stage');
    const visible = ['new', 'old', 'difference'].filter(
        (name) => getComputedStyle(document.getElementById(`shown-${name}`)).visibility === 'visible');
    const whole = ['new', 'old', 'difference'].every((name) => document.getElementById(`shown-${name}`).naturalWidth > 0);
    return { mode: dataset.mode, line: style.getPropertyValue('--line-at'), visible: visible.join(' '), whole };
});

async function views(page) {
    await page.click('a[data-view="new"] >> nth=1');
    await page.waitForFunction(() => Array.from(document.querySelectorAll('#stage img')).every((i) => i.naturalWidth));
    assert.deepEqual(await stage(page), { mode: 'slider', line: '50%', visible: 'new old', whole: true });
    await page.fill('#line', '20');
    assert.equal((await stage(page)).line, '20%');
    const box = await (await page.$('#stage')).boundingBox();
    await page.mouse.move(box.x + 0.3 * box.width, box.y + 0.5 * box.height);
    await page.mouse.down();
    await page.mouse.move(box.x + 0.75 * box.width, box.y + 0.5 * box.height);
    await page.mouse.up();
    assert(Math.abs(parseFloat((await stage(page)).line) - 75) < 1, 'the line follows the pointer');
    assert(box.x >= 0 && box.x + box.width <= page.viewportSize().width, 'the picture fits the window');
    await page.click('#modes button[data-mode="blink"]');
    const seen = new Set();
    for (let i = 0; i < 20 && seen.size < 2; i += 1) {
        seen.add((await stage(page)).visible);
        await page.waitForTimeout(100);
    }
    assert.deepEqual([...seen].sort(), ['new', 'old'], 'blinking shows both in turn');
    for (const mode of ['new', 'old', 'difference']) {
        await page.click(`#modes button[data-mode="${mode}"]`);
        assert.equal((await stage(page)).visible, mode);
    }
    const name = await page.textContent('#viewer-name');
    await page.click('#previous');
    assert.notEqual(await page.textContent('#viewer-name'), name);
    assert(await page.isDisabled('#previous'), 'the first pair has none before it');
    await page.keyboard.press('Escape');
    assert.equal(await page.evaluate(() => document.getElementById('viewer').open), false);
}

/** Nothing is wider than the window, and everything is loaded from the folder of the report. */
async function fits(page) {
    assert.equal(await page.evaluate(() => document.documentElement.scrollWidth), page.viewportSize().width);
    const home = pathToFileURL(report).href;
    assert.deepEqual(page.loaded.filter((address) => !address.startsWith(home)), []);
    assert.deepEqual(page.faults, []);
}

async function screenshot(page, name) {
    if (!shots) return;
    await page.evaluate(() => window.scrollTo(0, 0));
    await page.waitForTimeout(300);
    await page.screenshot({ path: join(shots, `${name}.png`) });
    await page.click('a[data-view="new"] >> nth=0');
    await page.waitForTimeout(300);
    await page.screenshot({ path: join(shots, `${name}-slider.png`) });
    await page.keyboard.press('Escape');
    if (await page.$('.unpaired')) {
        await page.evaluate(() => document.querySelector('.unpaired').scrollIntoView());
        await page.waitForTimeout(300);
        await page.screenshot({ path: join(shots, `${name}-unpaired.png`) });
    }
}

async function main() {
    browser = await chromium.launch({ executablePath: process.env.CHROMIUM || '/usr/bin/chromium', args: ARGUMENTS });
    for (const width of [380, 900, 1600]) {
        for (const scheme of ['light', 'dark']) {
            const page = await open(width, scheme);
            await screenshot(page, `${width}-${scheme}`);
            await sorts(page);
            await filters(page);
            await views(page);
            await fits(page);
            console.log(`${width} pixels, ${scheme}: sorting, filters, slider, blinking and size are right`);
            await page.context().close();
        }
    }
    const page = await open(900, 'light', { javaScriptEnabled: false });
    assert.equal((await page.$$('#scenes tbody tr')).length, data.pairs.length);
    assert.equal(await page.isVisible('#controls'), false);
    assert.equal(await page.isVisible('#viewer'), false);
    console.log('without scripts: all pairs are in the table');
    await browser.close();
}

main().catch((error) => {
    console.error(error);
    process.exit(1);
});
