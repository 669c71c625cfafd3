// The WebSocket: says hello with the token of the page's address, connects again when it is lost, asks and hands on answers.

const FIRST_WAIT_MS = 250;
const WAIT_MAX_MS = 5000;
const ENDED_WAIT_MS = 15_000;
const ANSWER_MS = 60_000;
/** Close code of a console whose run has ended. */
const ENDED = 4410;

/** Why the server closed, where another try is of no use. */
const REFUSED = /** @type {Record<number, string>} */ ({
  4401: "The token in this page's address is not valid for this console. Open an address that foosim view printed.",
  4403: "This page comes from another address than the console's. Open the address that foosim view printed.",
});

/** The token behind `#view=` or `#operate=` in an address; empty without one. @param {string} hash */
export function tokenOf(hash) {
  const parameters = new URLSearchParams(hash.replace(/^#/, ""));
  return parameters.get("operate") ?? parameters.get("view") ?? "";
}

/**
 * @typedef {object} Handlers
 * @property {(buffer: ArrayBuffer) => void} binary
 * @property {(message: any) => void} message
 * @property {(connected: boolean, text: string) => void} changed connected or not, and what to tell people
 */

export class Connection {
  /** @param {string} url @param {string} token @param {Handlers} handlers */
  constructor(url, token, handlers) {
    this._url = url;
    this._token = token;
    this._handlers = handlers;
    this._wait_ms = FIRST_WAIT_MS;
    this._asked = 0;
    /** @type {Map<number, {resolve: (answer: Answer) => void, reject: (error: Error) => void, timer: number}>} */
    this._waiting = new Map();
    /** @type {WebSocket | null} */
    this._socket = null;
    this.connected = false;
    this._has_ended = false;
  }

  open() {
    const socket = new WebSocket(this._url);
    socket.binaryType = "arraybuffer";
    this._socket = socket;
    socket.addEventListener("open", () => socket.send(JSON.stringify({ type: "hello", token: this._token })));
    socket.addEventListener("message", (event) => this._take(event.data));
    socket.addEventListener("close", (event) => this._closed(event));
  }

  /** Send a message; one that finds no connection is lost, and says so by false. @param {object} message */
  send(message) {
    if (!this.connected || this._socket?.readyState !== WebSocket.OPEN) return false;
    this._socket.send(JSON.stringify(message));
    return true;
  }

  /**
   * Ask for something and return its answer; rejects when the connection is lost before it.
   * @param {number} source
   * @param {string} verb
   * @param {Record<string, any>} [given]
   * @returns {Promise<Answer>}
   */
  ask(source, verb, given = {}) {
    this._asked += 1;
    const id = this._asked;
    return new Promise((resolve, reject) => {
      if (!this.send({ type: "request", id, source, verb, arguments: given })) {
        reject(new Error(`${verb}: not connected`));
        return;
      }
      const timer = window.setTimeout(() => this._give_up(id, `${verb}: no answer within ${ANSWER_MS / 1000} s`), ANSWER_MS);
      this._waiting.set(id, { resolve, reject, timer });
    });
  }

  /** @param {string | ArrayBuffer} data */
  _take(data) {
    if (data instanceof ArrayBuffer) {
      this._handlers.binary(data);
      return;
    }
    const message = JSON.parse(data);
    if (message.type === "welcome") {
      this.connected = true;
      this._wait_ms = FIRST_WAIT_MS;
      this._has_ended = false;
      this._handlers.changed(true, "");
    } else if (message.type === "answer") {
      const waiting = this._waiting.get(message.id);
      if (waiting) {
        this._waiting.delete(message.id);
        window.clearTimeout(waiting.timer);
        waiting.resolve(message);
      }
    }
    this._handlers.message(message);
  }

  /** @param {number} id @param {string} text */
  _give_up(id, text) {
    const waiting = this._waiting.get(id);
    if (!waiting) return;
    this._waiting.delete(id);
    window.clearTimeout(waiting.timer);
    waiting.reject(new Error(text));
  }

  /** @param {CloseEvent} event */
  _closed(event) {
    this.connected = false;
    for (const id of [...this._waiting.keys()]) {
      this._give_up(id, "the connection was lost before the answer; look whether it took effect");
    }
    const refused = REFUSED[event.code];
    if (refused) {
      this._handlers.changed(false, refused);
      return;
    }
    if (event.code === ENDED) this._has_ended = true;
    const full = event.code === 4429 ? "the console has as many pages as it takes" : "";
    const why = full || event.reason || "the console does not answer";
    this._handlers.changed(false, event.code === ENDED ? event.reason : `Not connected: ${why}. Trying again …`);
    // Pages that were lost together do not come back together. Of a run that is over nobody may ever come back.
    const wait_ms = this._has_ended ? ENDED_WAIT_MS : this._wait_ms;
    window.setTimeout(() => this.open(), wait_ms * (0.75 + 0.5 * Math.random()));
    this._wait_ms = Math.min(WAIT_MAX_MS, this._wait_ms * 2);
  }
}
