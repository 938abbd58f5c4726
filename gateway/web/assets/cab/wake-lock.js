// Keeps the screen on if the browser allows it, and says if it does not.

// Names of rows in /assets/words/cab.js
const HELD = "awake";
const INSECURE = "awake_insecure";
const UNKNOWN = "awake_unknown";
const REFUSED = "awake_refused";

/** Requests it at once, whenever the page becomes visible again, and at a touch; calls `tell` with the result. */
export function stayAwake(tell) {
  let lock = null;

  async function hold() {
    if (lock !== null || document.visibilityState !== "visible") return;
    if (navigator.wakeLock === undefined) {
      tell(window.isSecureContext ? UNKNOWN : INSECURE);
      return;
    }
    try {
      lock = await navigator.wakeLock.request("screen");
    } catch (error) {
      tell(REFUSED);
      return;
    }
    tell(HELD);
    lock.addEventListener("release", () => {
      lock = null;
      tell(REFUSED);
    });
  }

  document.addEventListener("visibilitychange", hold);
  document.addEventListener("click", hold);
  hold();
}
