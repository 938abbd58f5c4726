-- What a fleet's vehicles told, in PostgreSQL 15 or later: psql --set ON_ERROR_STOP=1 --file schema.sql
-- It can be run again: what is there stays.

CREATE TABLE IF NOT EXISTS estimate (
    vehicle_id      text NOT NULL,        -- from the topic, which the broker's access list guards
    id              text NOT NULL,        -- of the batch: what comes twice is one row
    vin             text,
    t_start         timestamptz NOT NULL,
    t_end           timestamptz NOT NULL,
    received        timestamptz NOT NULL DEFAULT now(),
    payload_kg      double precision,
    payload_std_kg  double precision,
    gross_kg        double precision,
    gross_limit_kg  double precision,
    front_axle_kg   double precision,
    rear_axle_kg    double precision,
    is_over_limit   boolean NOT NULL,     -- of any of its weights
    mean_speed_mps  double precision,
    rejected        text[] NOT NULL,
    calibration_id  text,
    stream          text,                 -- the three of `sequence`: see docs/uplink.md
    number          bigint,
    previous        bigint,
    record          jsonb NOT NULL,
    PRIMARY KEY (vehicle_id, id)
);
CREATE INDEX IF NOT EXISTS estimate_of_vehicle ON estimate (vehicle_id, t_end DESC);
CREATE INDEX IF NOT EXISTS estimate_in_time ON estimate USING brin (t_end);
CREATE INDEX IF NOT EXISTS estimate_in_sequence ON estimate (vehicle_id, stream, number);

-- Load events, trips and alarms, each in its last revision.
CREATE TABLE IF NOT EXISTS entry (
    vehicle_id  text NOT NULL,
    id          text NOT NULL,
    kind        text NOT NULL,
    revision    integer NOT NULL,
    t_start     timestamptz,
    t_end       timestamptz,
    received    timestamptz NOT NULL DEFAULT now(),
    record      jsonb NOT NULL,
    PRIMARY KEY (vehicle_id, id)
);
CREATE INDEX IF NOT EXISTS entry_of_kind ON entry (kind, t_end DESC);

-- The last word of each vehicle about itself.
CREATE TABLE IF NOT EXISTS vehicle (
    vehicle_id      text PRIMARY KEY,
    state           text NOT NULL,
    reason          text,
    vin             text,
    version         text,
    calibration_id  text,
    since           timestamptz NOT NULL DEFAULT now()
);

-- What could not be understood, so that nothing is lost and nothing holds up the rest.
CREATE TABLE IF NOT EXISTS unreadable (
    received  timestamptz NOT NULL DEFAULT now(),
    topic     text NOT NULL,
    fault     text NOT NULL,
    payload   bytea NOT NULL
);

-- Records that name a predecessor which never came.
CREATE OR REPLACE VIEW missing AS
SELECT late.vehicle_id, late.stream, late.previous AS number, late.t_end AS before_t_end
FROM estimate AS late
WHERE late.previous > 0
  AND NOT EXISTS (
    SELECT FROM estimate AS early
    WHERE (early.vehicle_id, early.stream, early.number) = (late.vehicle_id, late.stream, late.previous)
  );

-- The newest answer of each vehicle; rejections are no answers.
CREATE OR REPLACE VIEW latest AS
SELECT found.*
FROM vehicle
CROSS JOIN LATERAL (
    SELECT *
    FROM estimate
    WHERE estimate.vehicle_id = vehicle.vehicle_id AND rejected = '{}'
    ORDER BY t_end DESC
    LIMIT 1
) AS found;

DO $$
BEGIN
    IF NOT EXISTS (SELECT FROM pg_roles WHERE rolname = 'springscale_reader') THEN
        CREATE ROLE springscale_reader LOGIN;
    END IF;
END
$$;
GRANT SELECT ON ALL TABLES IN SCHEMA public TO springscale_reader;
