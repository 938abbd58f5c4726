#!/bin/sh
# The password of the role that Grafana reads with; run once, by the container of a new database, after schema.sql.
set -eu
psql --set ON_ERROR_STOP=1 --username "$POSTGRES_USER" --dbname "$POSTGRES_DB" --set word="$READER_PASSWORD" <<'SQL'
ALTER ROLE springscale_reader PASSWORD :'word'
SQL
