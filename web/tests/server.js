// A plain server of static files below a sub-path, as a published page has.
const { createServer } = require('node:http');
const { readFile } = require('node:fs/promises');
const { extname, join, normalize } = require('node:path');

const TYPES = {
    '.css': 'text/css', '.html': 'text/html', '.js': 'text/javascript', '.json': 'application/json',
    '.svg': 'image/svg+xml', '.wasm': 'application/wasm',
};

/**
 * Serves a folder at `/sub/` and below any other name, with more headers; `changed(path, bytes)` are
 * the bytes that are sent. Resolves to the page's address and a function that ends the server.
 */
exports.serve = (folder, headers = {}, changed = (path, bytes) => bytes) => new Promise((go) => {
    const server = createServer(async (request, response) => {
        const path = decodeURIComponent(new URL(request.url, 'http://page').pathname);
        const below = normalize(path.replace(/^\/[^/]+\//, '')) || 'index.html';
        try {
            const bytes = await readFile(join(folder, below === '.' || below === '/' ? 'index.html' : below));
            response.writeHead(200, { 'content-type': TYPES[extname(below)] ?? 'text/html', ...headers });
            response.end(changed(path, bytes));
        } catch {
            response.writeHead(404).end();
        }
    });
    server.listen(0, '127.0.0.1', () => go({
        address: `http://127.0.0.1:${server.address().port}/sub/`,
        end: () => server.close(),
    }));
});
