// Files that the test gives to the page and to the program.
const { deflateRawSync, crc32 } = require('node:zlib');
const { readFileSync } = require('node:fs');

/** Reads a binary PPM of 8 bits: its size and its bytes. */
exports.ppm = (path) => {
    const bytes = readFileSync(path);
    const numbers = [];
    let at = 2;
    while (numbers.length < 3) {
        const text = bytes.subarray(at, at + 20_000).toString('latin1');
        const [whole, number] = /^\s*(?:#[^\n]*\n\s*)*(\d+)/.exec(text);
        numbers.push(Number(number));
        at += whole.length;
    }
    return { width: numbers[0], height: numbers[1], rgb: bytes.subarray(at + 1) };
};

const table = new Uint32Array(256).map((_, n) => {
    let c = n;
    for (let k = 0; k < 8; k++) {
        c = c & 1 ? 0xedb8_8320 ^ c >>> 1 : c >>> 1;
    }
    return c;
});
const checksum = crc32 ?? ((bytes) => ~bytes.reduce((c, b) => table[(c ^ b) & 255] ^ c >>> 8, -1) >>> 0);

/** Packs files, of which every second is deflated, as a .zip archive. */
exports.zipped = (files) => {
    const parts = [], entries = [];
    let at = 0;
    files.forEach(([name, bytes], i) => {
        const packed = i % 2 === 0 ? deflateRawSync(bytes) : bytes;
        const common = Buffer.alloc(26);
        common.writeUInt16LE(20, 0);
        common.writeUInt16LE(i % 2 === 0 ? 8 : 0, 4);
        common.writeUInt32LE(checksum(bytes), 10);
        common.writeUInt32LE(packed.length, 14);
        common.writeUInt32LE(bytes.length, 18);
        common.writeUInt16LE(name.length, 22);
        const entry = Buffer.alloc(46);
        entry.writeUInt32LE(0x0201_4b50, 0);
        common.copy(entry, 6);
        entry.writeUInt32LE(at, 42);
        entries.push(entry, Buffer.from(name));
        const local = Buffer.concat([Buffer.from('PK\x03\x04'), common, Buffer.from(name), packed]);
        parts.push(local);
        at += local.length;
    });
    const directory = Buffer.concat(entries);
    const end = Buffer.alloc(22);
    end.writeUInt32LE(0x0605_4b50, 0);
    end.writeUInt16LE(files.length, 8);
    end.writeUInt16LE(files.length, 10);
    end.writeUInt32LE(directory.length, 12);
    end.writeUInt32LE(at, 16);
    return Buffer.concat([...parts, directory, end]);
};
