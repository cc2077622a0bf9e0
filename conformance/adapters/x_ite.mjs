// Opens VRML97 files in X_ITE and answers a line of JSON for each line {"file", "size"} of standard input.
//   node x_ite.mjs FOLDER SUITE     FOLDER has node_modules/x_ite and node_modules/playwright-core; SUITE has the files
import { createServer } from "node:http";
import { readFile } from "node:fs/promises";
import { resolve, join } from "node:path";
import { createInterface } from "node:readline";
import { pathToFileURL } from "node:url";

const [folder, suite] = process.argv.slice(2);
const { chromium } = (await import(pathToFileURL(resolve(folder, "node_modules/playwright-core/index.js")))).default;
const page = `<!doctype html><link rel="icon" href="data:,"><style>body { margin: 0 } x3d-canvas { display: block; border: 0 }</style>
<script src="/x_ite/x_ite.min.js"></script><x3d-canvas id="view" contentScale="1" splashScreen="false" notifications="false"></x3d-canvas>`;

const server = createServer(async (request, response) => {
  const path = decodeURIComponent(new URL(request.url, "http://localhost").pathname);
  try {
    if (path === "/") return response.setHeader("Content-Type", "text/html").end(page);
    const root = path.startsWith("/x_ite/") ? resolve(folder, "node_modules/x_ite/dist") : resolve(suite);
    const kind = { wrl: "model/vrml", js: "text/javascript", mjs: "text/javascript", css: "text/css", wasm: "application/wasm" };
    response.setHeader("Content-Type", kind[path.split(".").pop()] ?? "application/octet-stream");
    response.end(await readFile(join(root, path.replace("/x_ite/", "/"))));
  } catch {
    response.writeHead(404).end();
  }
}).listen(0, "127.0.0.1");
await new Promise((done) => server.once("listening", done));
const address = `http://127.0.0.1:${server.address().port}/`;

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--enable-unsafe-swiftshader", "--use-angle=swiftshader", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--no-first-run"],
});

const SECONDS = 20;
let tab, messages = [];

async function open() {
  tab = await browser.newPage();
  const counts = (m) => ["error", "warning"].includes(m.type()) && !m.text().includes("GL Driver");
  tab.on("console", (m) => counts(m) && messages.push(m.text()));
  await tab.goto(address);
  await tab.waitForFunction(() => document.querySelector("x3d-canvas").browser);
}

async function answer({ file, size: [width, height] }) {
  messages = [];
  try {
    await tab.setViewportSize({ width, height });
    const loaded = tab.evaluate(async ([url, width, height]) => {
      const canvas = document.querySelector("x3d-canvas");
      canvas.style.width = `${width}px`;
      canvas.style.height = `${height}px`;
      const world = canvas.browser;
      world.setBrowserOption("PrimitiveQuality", "HIGH");
      await world.loadURL(new X3D.MFString(url));
      for (let i = 0; i < 5; i++) await world.nextFrame();
      return world.currentScene.toVRMLString();
    }, ["/" + file, width, height]);
    const late = new Promise((_, fail) => setTimeout(() => fail(new Error(`not done after ${SECONDS} s`)), 1000 * SECONDS));
    late.catch(() => {});
    const tree = await Promise.race([loaded, late]);
    const picture = await tab.screenshot({ timeout: 10000 });
    return { tree, messages, picture: picture.toString("base64") };
  } catch (error) {
    if (String(error).includes("not done")) {
      tab.close().catch(() => {});
      await open();
    }
    return { refused: [String(error).split("\n")[0], ...messages].join("; ") };
  }
}

await open();
for await (const line of createInterface({ input: process.stdin })) {
  process.stdout.write(JSON.stringify(await answer(JSON.parse(line))) + "\n");
}
await Promise.race([browser.close(), new Promise((done) => setTimeout(done, 5000))]);
process.exit();
