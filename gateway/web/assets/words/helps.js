// What narrows the accuracy, by the name that the gateway gives it: [English, German].

export const HELPS = {
  "help.empty_drive": ["another empty drive", "noch eine Leerfahrt"],
  "help.another_speed": ["an empty drive at another speed", "eine Leerfahrt mit anderer Geschwindigkeit"],
  "help.delivery_note": ["the delivery note of a drive with a large load", "der Lieferschein einer Fahrt mit großer Ladung"],
  "help.scale": ["a large load on a scale", "eine große Ladung auf einer Waage"],
  "help.axle_scales": ["a large load on a scale, axle by axle", "eine große Ladung auf einer Waage, Achse für Achse"],
  "help.known_load_front": ["a known load behind the front seats", "eine bekannte Ladung hinter den Vordersitzen"],
  "help.known_load_rear": ["a known load over the rear axle", "eine bekannte Ladung über der Hinterachse"],
};
