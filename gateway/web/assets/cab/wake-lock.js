// Keeps the screen on where the browser lets a page do so, and says where it does not.

const TIME_OUT = "set the phone's own screen time-out to never";
const HELD = "The screen stays on.";
const INSECURE = `The phone may switch its screen off: browsers keep it on over HTTPS only. Till then ${TIME_OUT}.`;
const UNKNOWN = `The phone may switch its screen off: this browser cannot keep it on, so ${TIME_OUT}.`;
const REFUSED = "The phone may switch its screen off: it refused to keep it on, to save its battery perhaps. Touch the page to ask again.";

/** Asks at once, whenever the page is looked at again, and at a touch; `tell` hears how it went. */
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
