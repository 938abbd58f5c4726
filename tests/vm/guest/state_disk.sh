#!/bin/sh
# The state directory on a disk of its own, under device-mapper's log-writes: state_disk.sh DISK LOG
set -e
modprobe dm-log-writes
dmsetup create state --table "0 $(blockdev --getsz "$1") log-writes $1 $2"
mount /dev/mapper/state /var/lib/springscale
