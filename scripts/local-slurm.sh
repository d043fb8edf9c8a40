#!/bin/bash
# Runs a Slurm cluster on this machine, to try out job arrays. Needs root and Debian's packages slurmctld, slurmd,
# slurm-client and munge:
#   scripts/local-slurm.sh start DIR      configuration, state and logs go to DIR
#   export SLURM_CONF=DIR/slurm.conf      for sbatch, squeue and sqslam --on slurm
#   scripts/local-slurm.sh stop DIR
# Uses the ports SLURM_PORT (default: 16817) and SLURM_PORT + 1.
set -euo pipefail
if [ $# -ne 2 ] || { [ "$1" != start ] && [ "$1" != stop ]; }; then
  echo "usage: scripts/local-slurm.sh start|stop DIR" >&2
  exit 2
fi
folder=$(realpath -m "$2")
node=$(hostname -s)
port=${SLURM_PORT:-16817}
export SLURM_CONF=$folder/slurm.conf

if [ "$1" = stop ]; then
  daemons=$(cat "$folder/slurmctld.pid" "$folder/slurmd.pid" 2>/dev/null || true)  # one may have failed to start
  scancel --user=root --quiet || true
  scontrol shutdown || kill $daemons || true
  for daemon in $daemons; do  # they write their state as they end
    timeout 30 tail --pid="$daemon" -f /dev/null
  done
  if [ -s "$folder/munged.pid" ]; then kill "$(cat "$folder/munged.pid")"; fi
  exit 0
fi

mkdir -p "$folder/state" "$folder/spool" /run/munge
chown munge /run/munge
cat >"$SLURM_CONF" <<CONF
ClusterName=local
SlurmctldHost=$node(127.0.0.1)
SlurmctldPort=$port
SlurmdPort=$((port + 1))
AuthType=auth/munge
SlurmUser=root
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerParameters=batch_sched_delay=0,bf_interval=1
MpiDefault=none
ReturnToService=2
# Without an epilog, tasks that end at once are noticed only by the next look around, up to a second later.
Epilog=/bin/true
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
NodeName=$node NodeAddr=127.0.0.1 CPUs=$(nproc) RealMemory=$(awk '/MemTotal/ {print int($2 / 1024 * 0.9)}' /proc/meminfo) State=UNKNOWN
PartitionName=all Nodes=$node Default=YES MaxTime=INFINITE State=UP
CONF
if ! munge -n 2>/dev/null | unmunge >/dev/null 2>&1; then
  su -s /bin/sh munge -c /usr/sbin/munged
  pgrep -n -u munge munged >"$folder/munged.pid"
fi
slurmctld -f "$SLURM_CONF"
slurmd -f "$SLURM_CONF"
for _ in $(seq 60); do  # until the node is there
  if [ "$(sinfo -h -o %T 2>/dev/null)" = idle ]; then
    sinfo
    exit 0
  fi
  sleep 0.5
done
"$0" stop "$folder" || true
echo "local-slurm: no node after half a minute; see $folder/slurmctld.log" >&2
exit 1
