// Keeps the screen on if the browser allows it, and says how it is, by the name of a row in /assets/words/cab.js.

/** Requests it at once, whenever the page becomes visible again, and at a touch; calls `tell` with the result. */
export function stayAwake(tell) {
  let lock = null;

  async function hold() {
    if (lock !== null || document.visibilityState !== "visible") return;
    if (navigator.wakeLock === undefined) {
      tell(window.isSecureContext ? "awake_refused" : "awake_insecure");
      return;
    }
    try {
      lock = await navigator.wakeLock.request("screen");
    } catch (error) {
      tell("awake_refused");
      return;
    }
    tell("awake");
    lock.addEventListener("release", () => {
      lock = null;
      tell("awake_refused");
    });
  }

  document.addEventListener("visibilitychange", hold);
  document.addEventListener("click", hold);
  hold();
}
