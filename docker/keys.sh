#!/bin/sh
# Keys for a deployment, and a folder for each role: a machine gets its role's folder, with a key and the list of all.
#   keys              make what is missing
#   keys revoke NAME  or any other command of `orchestrator keys`; then every folder gets the new list
set -eu
folder=/keys
roles="render perception agent orchestrator"
owner=1000:1000

for role in $roles; do
    [ -f "$folder/$role.key" ] || orchestrator keys new "$role" --role "$role" --dir "$folder"
done
if [ "$#" -gt 0 ]; then
    orchestrator keys "$@" --dir "$folder"
fi
for role in $roles; do
    mkdir -p "$folder/$role"
    [ -f "$folder/$role/$role.key" ] || cp "$folder/$role.key" "$folder/$role/$role.key"
    # Renamed into place: a process that reads the list meanwhile sees the old one or the new one.
    cp "$folder/allowed.json" "$folder/$role/.allowed.json"
    chown "$owner" "$folder/$role/$role.key" "$folder/$role/.allowed.json"
    mv "$folder/$role/.allowed.json" "$folder/$role/allowed.json"
done
