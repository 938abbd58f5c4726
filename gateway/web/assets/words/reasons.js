// German for the English of /api/v1/reasons: why a batch was not weighed [what happened, what to do], the sources
// of an estimate's error, and what would narrow it.

export const REASONS_DE = {
  no_estimate_yet: ["seit der Speicher angelegt wurde, ist nichts gewogen worden", "fahren; der erste Abschnitt endet nach `window_s`"],
  no_calibration: ["keine Kalibrierung ist angegeben, oder sie enthält den gewählten Schätzer nicht", "`springscale calibrate`, dann die Datei unter `calibration` nennen"],
  too_short: ["die Fahrt endete, bevor der Abschnitt voll war (`last_batch_share_min`), oder sie war zu unruhig", "weiterfahren oder `window_s` verkürzen"],
  gap: ["Botschaften beider Sensoren fehlen (`gap_s`, `gap_share_max`), oder Stille beendete die Fahrt (`silence_s`)", "Verluste und Buszustand in `/api/v1/status` ansehen; Verkabelung und Last des Gateways prüfen"],
  clock_step: ["Zeitstempel sprangen um mehr als `clock_step_s` zurück", "die Uhr stellen, bevor der Dienst startet"],
  trailer: ["zu lange im Abschnitt hing ein Anhänger am Fahrzeug (Signal `trailer`): er schiebt und zieht, und seine Deichsel ist keine Ladung", "nichts; ohne Anhänger wird wieder gewogen"],
  too_slow: ["zu viel des Abschnitts war langsamer als `speed_min_mps`: Stadt, Stau, Hof", "nichts; die nächste freie Straße genügt. War es eine, stimmt Einheit oder Faktor der Geschwindigkeit in der Datenbank nicht"],
  too_fast: ["zu viel des Abschnitts war schneller als `speed_max_mps`", "Einheit oder Faktor der Geschwindigkeit in der Datenbank berichtigen"],
  speed_spread: ["die Geschwindigkeit schwankte stärker, als der Verhältnisindex verträgt", "gleichmäßig fahren; `cross_spectrum` verträgt mehr als `ratio_index`"],
  load_changed: ["die Ladung änderte sich bei einem Halt, und mit der davor wurde zu wenig gefahren, um sie zu wiegen (eine Minute)", "nichts; die Ladung nach dem Halt wird gewogen"],
  speed_uncalibrated: ["die mittlere Geschwindigkeit liegt außerhalb der kalibrierten", "auch mit dieser Geschwindigkeit kalibrieren"],
  not_enough_excitation: ["die Straße war zu glatt, um Ladungen zu unterscheiden", "nichts; eine gewöhnliche Straße genügt"],
  speed_missing: ["zu lange keine gültige Geschwindigkeit (`speed_hold_s`)", "Antenne und `valid_when` im Signalplan prüfen; auch `wheel_speed` zuordnen"],
  speed_frozen: ["die Geschwindigkeit wiederholte `speed_frozen_s` lang eine Zahl, während Botschaften kamen", "Empfänger neu starten; Antenne prüfen"],
  acceleration_missing: ["der Beschleunigungssensor schwieg oder meldete sich als nicht verfügbar", "Signalplan und Gerät prüfen"],
  pitch_rate_missing: ["der Nickratensensor schwieg oder meldete sich als nicht verfügbar", "Signalplan und Gerät prüfen"],
  acceleration_stuck: ["die Beschleunigung wiederholte `stuck_s` lang eine Zahl", "Gerät aus- und einschalten oder ersetzen"],
  pitch_rate_stuck: ["die Nickrate wiederholte `stuck_s` lang eine Zahl", "Gerät aus- und einschalten oder ersetzen"],
  acceleration_saturated: ["die Beschleunigung stand am Ende ihres Messbereichs", "im Gerät einen größeren Messbereich wählen"],
  pitch_rate_saturated: ["die Nickrate stand am Ende ihres Messbereichs", "im Gerät einen größeren Messbereich wählen"],
  gravity_missing: ["die mittlere Vertikalbeschleunigung ist weit von 9,81 m/s² entfernt", "falsche Achse, falsches Vorzeichen oder falsche Einheit im Signalplan, oder das Gerät zieht die Erdbeschleunigung ab"],
  time_stamps: ["die Zeitstempel sind zu ungleichmäßig, oder zu viele Botschaften fehlen", "im Kernel stempeln (socketcan), den Rechner entlasten oder `counter` der Botschaft im Signalplan nennen"],
  sensor_rate_low: ["der Sensor sendet für `rate_hz` zu selten", "seine Rate erhöhen"],
  sample_rate: ["die Sensoren tasten um mehr als ein Viertel schneller oder langsamer ab als bei der Kalibrierung: andere Schwingungen falten sich in ihre Werte", "das Gerät auf die kalibrierte Rate einstellen oder mit dieser neu kalibrieren"],
  sensor_changed: ["der Sensor ist nicht mehr, wo oder was er bei der Kalibrierung war: versetzt, gedreht oder mit anderer Verstärkung", "wie zuvor montieren oder neu kalibrieren"],
  sensor_noisy: ["ein Sensor rauscht mehr als doppelt so stark wie bei der Kalibrierung, und sein Rauschen lässt keine Ladung erkennen", "nach lockerer Befestigung, schlechter Versorgung oder geändertem Filter oder Messbereich suchen; oder ihn ersetzen"],
  sensor_disagreement: ["Beschleunigung und Nickrate bewegen sich nicht wie ein Körper", "prüfen, ob beide vom selben starren Ort und Zeitgeber kommen"],
  wrong_sign: ["die Nickrate passt nur umgekehrt zum Fahrzeug", "`sign` von `pitch_rate` im Signalplan umkehren (positiv: Nase nach unten)"],
  out_of_range: ["das 95-%-Intervall liegt ganz außerhalb der kalibrierten Ladungen oder Anteile", "mit solchen Ladungen kalibrieren oder Fahrzeug und Sensor prüfen"],
  too_uncertain: ["das Intervall wäre zu breit, um zu nützen", "mit ähnlicheren Ladungen kalibrieren; länger oder auf rauerer Straße fahren"],
  ambiguous: ["zwei weit auseinanderliegende Ladungen erklären diese Spektren etwa gleich gut", "weiterfahren, auf anderer Straße oder mit anderer Geschwindigkeit; mit mehr Ladungen kalibrieren"],
  model_misfit: ["keine Nutzlast erklärt diese Spektren so gut, wie die Kalibrierung erwarten lässt", "nach geänderten Reifen, Federn oder Sensorhaltern suchen; neu kalibrieren"],
  no_solution: ["die Suche nach der Ladung kam zu keinem Ende, oder ihre Zahlen gingen nicht auf", "nichts, wenn es selten ist; sonst ansehen, was die Sensoren senden, und neu kalibrieren"],
};

export const SOURCES_DE = {
  own: "Länge und Straße dieser Fahrt",
  calibration: "was die bekannten Ladungen vom Fahrzeug offen ließen",
  goods: "wie lang und hoch die Ladungen dieses Fahrzeugs meist sind",
  load_length: "wie lang und hoch genau diese Ladung ist",
  day: "Temperatur und Verschleiß von Federn, Reifen und Dämpfern",
  sensor: "die Verstärkung des Sensors",
  sideways: "wo die Ladung seitlich liegt",
  empty_share: "die Vorderachslast des leeren Fahrzeugs",
  model: "was das Modell des Fahrzeugs auslässt",
};

export const REMEDIES_DE = {
  drive_on: "weitere zehn Minuten mit derselben Ladung fahren",
  weigh_once: "einmal beladen wiegen und angeben, was die Waage zeigt",
  say_what_is_carried: "in den Fahrzeugdaten angeben, was geladen wird und wie lang und hoch es ist",
  weigh_empty: "angeben, wenn das Fahrzeug leer ist",
  read_roll_rate: "die Wankrate zuordnen, falls das Gerät sie sendet",
  weigh_axles_empty: "beide Achsen des leeren Fahrzeugs wiegen",
};
