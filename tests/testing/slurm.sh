#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# slurm.sh start FOLDER | slurm.sh lose FOLDER NODE | slurm.sh stop FOLDER
# A Slurm of its own with nodes n1, n2, n3 on this machine, all that it keeps in FOLDER (an absolute path); no systemd.
# `lose` ends a node's daemon and what runs there, as a loss of power would. For root; needs slurmctld, slurmd,
# slurm-client and munge. Afterwards: export SLURM_CONF=FOLDER/slurm.conf
set -eu
command=$1
folder=$2

start() {
  mkdir -p "$folder/munge" "$folder/state" "$folder/spool"
  chmod 755 "$folder"
  chmod 700 "$folder/munge"
  head -c 1024 /dev/urandom > "$folder/munge/key"
  chmod 400 "$folder/munge/key"
  munged --force --key-file="$folder/munge/key" --socket="$folder/munge/socket" --pid-file="$folder/munge/pid" \
    --log-file="$folder/munge/log" --seed-file="$folder/munge/seed"
  port=$((20000 + $$ % 10000))
  cat > "$folder/slurm.conf" << END
ClusterName=semblance
SlurmctldHost=localhost(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$folder/munge/socket
CredType=cred/munge
SlurmctldPort=$port
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool/%n
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.%n.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SwitchType=switch/none
MpiDefault=none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SlurmdTimeout=6
SchedulerParameters=batch_sched_delay=0,sched_interval=2
SlurmdParameters=config_overrides
NodeName=n1 NodeHostname=localhost NodeAddr=127.0.0.1 Port=$((port + 1)) CPUs=1
NodeName=n2 NodeHostname=localhost NodeAddr=127.0.0.1 Port=$((port + 2)) CPUs=1
NodeName=n3 NodeHostname=localhost NodeAddr=127.0.0.1 Port=$((port + 3)) CPUs=1
PartitionName=all Nodes=n[1-3] Default=YES MaxTime=INFINITE State=UP
END
  slurmctld -c -f "$folder/slurm.conf"
  for node in n1 n2 n3; do slurmd -N $node -f "$folder/slurm.conf"; done
  # Fails where the daemons started but do not find each other, for example without a loopback device.
  for attempt in $(seq 60); do
    if [ "$(SLURM_CONF="$folder/slurm.conf" sinfo -h -t idle -o '%D' 2> /dev/null)" = 3 ]; then return 0; fi
    sleep 0.5
  done
  echo "slurm.sh: the three nodes are not idle after 30 s" >&2
  return 1
}

# The scripts of jobs on a node, with what they started and the daemon that watches over them.
lose() {
  kill -9 "$(cat "$folder/slurmd.$1.pid")"
  for script in $(pgrep -f "$folder/spool/$1/"); do
    kill -9 "$(ps -o ppid= -p "$script" | tr -d ' ')" $(pgrep -P "$script") "$script" 2> /dev/null || true
  done
}

stop() {
  for node in n1 n2 n3; do lose $node 2> /dev/null || true; done
  for pid in "$folder/slurmctld.pid" "$folder/munge/pid"; do kill "$(cat "$pid")" 2> /dev/null || true; done
}

case $command in
  start) start ;;
  lose) lose "$3" ;;
  stop) stop ;;
  *) echo "slurm.sh: start, lose or stop, not '$command'" >&2; exit 2 ;;
esac
