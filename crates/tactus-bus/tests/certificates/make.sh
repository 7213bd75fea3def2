#!/bin/sh
# Makes the certificates of the tests anew, valid for a hundred years. They protect nothing: their keys are here for all to read.
set -eu
cd "$(dirname "$0")"
key() { openssl ecparam -name prime256v1 -genkey -noout | openssl pkcs8 -topk8 -nocrypt -out "$1.key"; }
authority() {
    key "$1"
    openssl req -x509 -new -key "$1.key" -days 36500 -subj "/CN=$1" -addext "basicConstraints=critical,CA:TRUE" -out "$1.pem"
}
# signed NAME AUTHORITY
signed() {
    key "$1"
    printf 'subjectAltName=DNS:localhost,IP:127.0.0.1\nextendedKeyUsage=serverAuth,clientAuth\nbasicConstraints=CA:FALSE\n' > extensions
    openssl req -new -key "$1.key" -subj "/CN=$1" |
        openssl x509 -req -CA "$2.pem" -CAkey "$2.key" -CAcreateserial -days 36500 -extfile extensions -out "$1.pem"
    rm -f extensions ./*.srl
}
authority lab-authority
signed service lab-authority
signed commander lab-authority
signed reader lab-authority
signed visitor lab-authority
authority stranger-authority
signed stranger stranger-authority
