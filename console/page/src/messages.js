// What comes over the WebSocket, decoded. Binary messages are poses; everything else is JSON.

const HEADER_BYTES = 24;
const POSES = 1;
const JUMP = 1;
const PAUSED = 2;
export const FLOATS_PER_LINK = 7;

/** Whether a link has a pose: what is absent has none. @param {Float32Array} poses @param {number} link */
export function isPlaced(poses, link) {
  return !Number.isNaN(poses[link * FLOATS_PER_LINK]);
}

/**
 * Decode a binary message: a header of 24 bytes, seven float32 for each link, one for each value that is plotted.
 * The arrays are views of the buffer. Throws where the length is not what the header says.
 * @param {ArrayBuffer} buffer
 * @returns {Poses}
 */
export function decodePoses(buffer) {
  const view = new DataView(buffer);
  if (buffer.byteLength < HEADER_BYTES) throw new Error(`a binary message of ${buffer.byteLength} bytes`);
  if (view.getUint8(0) !== POSES) throw new Error(`a binary message of kind ${view.getUint8(0)}`);
  const flags = view.getUint8(2);
  const links = view.getUint32(16, true);
  const values = view.getUint32(20, true);
  const expected = HEADER_BYTES + 4 * (FLOATS_PER_LINK * links + values);
  if (buffer.byteLength !== expected) {
    throw new Error(`poses of ${buffer.byteLength} bytes, ${links} links and ${values} values take ${expected}`);
  }
  return {
    source: view.getUint8(1),
    jump: (flags & JUMP) !== 0,
    paused: (flags & PAUSED) !== 0,
    generation: view.getUint32(4, true),
    tick: view.getFloat64(8, true),
    links: new Float32Array(buffer, HEADER_BYTES, FLOATS_PER_LINK * links),
    values: new Float32Array(buffer, HEADER_BYTES + 4 * FLOATS_PER_LINK * links, values),
  };
}

/** @param {string} text base64 */
function bytesOf(text) {
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let index = 0; index < binary.length; index += 1) bytes[index] = binary.charCodeAt(index);
  return bytes.buffer;
}

/**
 * The corners (m) and the triangles of a mesh.
 * @param {{vertices: string, triangles: string}} mesh
 */
export function decodeMesh(mesh) {
  return { vertices: new Float32Array(bytesOf(mesh.vertices)), triangles: new Uint32Array(bytesOf(mesh.triangles)) };
}
