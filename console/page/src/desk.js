// Requests: asks the console, shows what it answered, in the log and for some seconds over the page.

import { h } from "./ui.js";

const SHOWN_MS = 6000;
const TOASTS_MAX = 4;

export class Desk {
  /**
   * @param {import("./connection.js").Connection} connection
   * @param {import("./store.js").Store} store
   * @param {HTMLElement} toasts
   */
  constructor(connection, store, toasts) {
    this.connection = connection;
    this.store = store;
    this.toasts = toasts;
    store.on("note", (note) => {
      if (note.level !== "info") this.toast(note.level, note.text);
    });
  }

  /** Whether a verb may be asked of the main source. @param {string} verb */
  may(verb) {
    return this.connection.connected && this.store.main?.presence?.state !== "ended" && (this.store.main?.may(verb) ?? false);
  }

  /**
   * Ask, and return nothing when it was accepted, else what is wrong.
   * @param {string} verb
   * @param {Record<string, any>} [given]
   * @returns {Promise<string>}
   */
  async ask(verb, given = {}) {
    const { text, accepted } = await this.answered(verb, given);
    return accepted ? "" : text;
  }

  /**
   * Ask, and return the answer, also where there was none.
   * @param {string} verb
   * @param {Record<string, any>} [given]
   * @returns {Promise<{accepted: boolean, text: string, tick: number}>}
   */
  async answered(verb, given = {}) {
    try {
      return await this.connection.ask(0, verb, given);
    } catch (error) {
      const text = error instanceof Error ? error.message : String(error);
      this.store.note("error", text);
      return { accepted: false, text, tick: 0 };
    }
  }

  /** @param {string} level @param {string} text */
  toast(level, text) {
    const toast = h("div", { class: `toast ${level}`, role: level === "error" ? "alert" : "status" }, text);
    this.toasts.append(toast);
    while (this.toasts.children.length > TOASTS_MAX) this.toasts.firstElementChild?.remove();
    window.setTimeout(() => toast.remove(), SHOWN_MS);
  }
}
