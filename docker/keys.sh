#!/bin/sh
# Keys for a deployment, one folder for each role: what a machine gets is its folder, with its key and the list of all.
#   keys              make what is missing
#   keys revoke NAME  and whatever else `orchestrator keys` knows; the folders get the new list
set -eu
umask 077
folder=${VANTAGE_KEYS:-/keys}
owner=${VANTAGE_USER:-1000:1000}

if [ "$#" -gt 0 ]; then
    orchestrator keys "$@" --dir "$folder"
fi
for role in render perception agent orchestrator; do
    mkdir -p "$folder/$role"
    chmod 700 "$folder/$role"
    [ -f "$folder/$role.key" ] || orchestrator keys new "$role" --role "$role" --dir "$folder"
    [ -f "$folder/$role/$role.key" ] || cp "$folder/$role.key" "$folder/$role/$role.key"
done
for role in render perception agent orchestrator; do
    # Renamed into place: whoever reads the list while we write sees the old one or the new one.
    cp "$folder/allowed.json" "$folder/$role/.allowed.json"
    mv "$folder/$role/.allowed.json" "$folder/$role/allowed.json"
    chown -R "$owner" "$folder/$role"
done
echo "the keys of every role are in $folder"
