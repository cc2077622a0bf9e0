// Keeps the page for use without a network. The build writes the list of files and their version.

const VERSION = 'VERSION';
const FILES = ['FILES'];

addEventListener('install', (event) => {
    // The browser's own cache may still hold files of the version before.
    const fresh = FILES.map((file) => new Request(file, { cache: 'reload' }));
    const fill = async () => (await caches.open(VERSION)).addAll(fresh);
    event.waitUntil(fill().then(() => skipWaiting()));
});

addEventListener('activate', (event) => {
    const clean = async () => {
        const old = (await caches.keys()).filter((name) => name.startsWith('ivcam ') && name !== VERSION);
        await Promise.all(old.map((name) => caches.delete(name)));
        await clients.claim();
    };
    event.waitUntil(clean());
});

addEventListener('fetch', (event) => {
    const kept = async () => {
        const cache = await caches.open(VERSION);
        const found = await cache.match(event.request, { ignoreSearch: true });
        return found ?? fetch(event.request);
    };
    event.respondWith(kept());
});
