// The words of the fleet's page: [English, German].

export const FLEET = {
  title: ["Fleet – Springscale", "Flotte – Springscale"],
  fleet: ["Fleet", "Flotte"],
  search: ["Search", "Suchen"],
  vehicle: ["Vehicle", "Fahrzeug"],
  load: ["Load", "Ladung"],
  gross: ["Gross weight", "Gesamtgewicht"],
  age: ["Weighed", "Gewogen"],
  alarms: ["Alarms", "Alarme"],
  offline: ["offline", "offline"],
  intervals: ["± values are 95 % intervals. The bar is filled at the gross limit.", "Werte mit ± sind 95-%-Intervalle. Der Balken ist beim zulässigen Gesamtgewicht voll."],
  no_vehicle: ["No vehicle has reported yet.", "Noch hat sich kein Fahrzeug gemeldet."],
  summary: ["{n} vehicle, {over} over a limit, {alarmed} with an alarm|{n} vehicles, {over} over a limit, {alarmed} with an alarm", "{n} Fahrzeug, {over} über einer Grenze, {alarmed} mit Alarm|{n} Fahrzeuge, {over} über einer Grenze, {alarmed} mit Alarm"],
  found: ["{shown} of {n} shown", "{shown} von {n} gezeigt"],
  of_limit: ["{kg} of {limit}", "{kg} von {limit}"],
  over: ["over the limit: {places}", "über der Grenze: {places}"],
  since: ["since {time}", "seit {time}"],
  unreadable: ["{n} record could not be read|{n} records could not be read", "{n} Datensatz war nicht lesbar|{n} Datensätze waren nicht lesbar"],
  gone: ["The fleet's service does not answer. These are its last values.", "Der Dienst der Flotte antwortet nicht. Gezeigt wird, was er zuletzt gesendet hat."],
};
