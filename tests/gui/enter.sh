#!/bin/sh
# Runs a command inside a Debian folder, in the project, which is at /project there: enter.sh DEBIAN PROJECT COMMAND…
# To be started by unshare --mount: mounts in a namespace of their own end with the command, however it ends, so that
# deleting the folder can never reach the machine's own /dev.
set -eu
debian=$1 project=$2
shift 2
cd "$debian"
mkdir -p project
mount --rbind /dev dev
mount -t proc proc proc
mount -t tmpfs tmpfs tmp
mount --bind "$project" project
exec chroot . env --chdir=/project "$@"
