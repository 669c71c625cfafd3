// Whether the run is there, in words: the line over the page.

/**
 * What to say of a run that is away or has ended, or of a connection that is lost; empty for nothing.
 * How it has ended goes before why nobody answers any more.
 * @param {string} lost why there is no connection; empty with one
 * @param {Presence | null | undefined} presence
 */
export function bannerOf(lost, presence) {
  if (presence?.state === "ended") return presence.text;
  return lost || (presence?.text ?? "");
}

/**
 * The state beside the clock.
 * @param {boolean} connected
 * @param {Presence | null} presence
 * @param {string} told what the status says
 */
export function stateOf(connected, presence, told) {
  if (presence?.state === "ended") return presence.failed ? "failed" : "ended";
  if (!connected) return "not connected";
  return presence?.state === "away" ? "supervisor away" : told;
}
