// node pack.mjs IN OUT: a whole file in zstd.
import { readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";

const zstd = createRequire(import.meta.url)("@foxglove/wasm-zstd");
await zstd.isLoaded;
writeFileSync(process.argv[3], zstd.compress(readFileSync(process.argv[2]), 3));
