#!/bin/sh
# An authority of the fleet's own and the broker's certificate: make_certificates.sh NAME_OR_ADDRESS FOLDER
# Where ca.key is there already, only the broker's certificate is made anew. ca.key belongs on no server.
set -eu
name=$1 folder=$2
mkdir -p "$folder"
cd "$folder"
umask 077
case $name in
*[!0-9.]*) known_as=DNS:$name ;;
*) known_as=IP:$name ;;
esac
curve="-newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes"
# shellcheck disable=SC2086
if [ ! -e ca.key ]; then
    openssl req -x509 $curve -days 3650 -subj "/CN=fleet authority" -keyout ca.key -out ca.pem \
        -addext keyUsage=critical,keyCertSign,cRLSign
fi
# shellcheck disable=SC2086
openssl req $curve -subj "/CN=$name" -keyout broker.key -out broker.csr
cat >broker.ext <<EXT
basicConstraints=critical,CA:FALSE
keyUsage=critical,digitalSignature
extendedKeyUsage=serverAuth
subjectKeyIdentifier=hash
authorityKeyIdentifier=keyid
subjectAltName=$known_as
EXT
openssl x509 -req -in broker.csr -CA ca.pem -CAkey ca.key -CAcreateserial -days 825 -extfile broker.ext -out broker.pem
rm broker.csr broker.ext
chmod 644 ca.pem broker.pem
