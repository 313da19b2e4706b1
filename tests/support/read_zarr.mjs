// SPDX-License-Identifier: LGPL-2.1-or-later
// read_zarr.mjs FOLDER PIXELS: writes the pixels of an OME-Zarr as zarrita, a
// reader of its own (npm), reads them, and prints its shape and attributes.
import {writeFileSync} from "node:fs";
import FileSystemStore from "@zarrita/storage/fs";
import * as zarr from "zarrita";

const [folder, pixels] = process.argv.slice(2);
const group = await zarr.open(new FileSystemStore(folder), {kind: "group"});
const {path} = group.attrs.ome.multiscales[0].datasets[0];
const set = await zarr.open(group.resolve(path), {kind: "array"});
const {data} = await zarr.get(set);
writeFileSync(pixels, Buffer.from(data.buffer, data.byteOffset, data.byteLength));
console.log(JSON.stringify({shape: set.shape, type: set.dtype, ...group.attrs}));
