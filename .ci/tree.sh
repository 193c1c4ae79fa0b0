# Sourced by .ci/run, as root: trees of the other Debian release and of sid, kept between runs, to
# run the suite in. A function that cannot do its work returns non-zero and leaves one sentence in
# $why.

# other_release: leaves in $release the Debian release that this machine is not.
other_release() {
  local here
  here=$(. /etc/os-release && echo "${VERSION_CODENAME:-}")
  case $here in
    bookworm) release=trixie ;;
    trixie | sid) release=bookworm ;;
    *)
      why="this is no Debian 12, 13 or sid"
      return 1
      ;;
  esac
}

# make_tree RELEASE FOLDER: debootstrap from the mirror this machine uses, unless a sound tree is
# there.
make_tree() {
  local release=$1 tree=$2
  if [ ! -e "$tree/complete" ] || [ -n "$(chroot "$tree" /usr/bin/dpkg --audit 2>&1)" ]; then
    bootstrap "$release" "$tree" || return 1
  fi
  if ! in_tree "$tree" true 2>/dev/null; then
    why="namespaces and mounts are not permitted here"
    return 1
  fi
  cp /etc/resolv.conf /etc/hosts "$tree/etc/"
  cp /etc/ssl/certs/ca-certificates.crt "$tree/etc/ssl/certs/" # a house may have its own
}

# bootstrap RELEASE FOLDER: makes the tree anew.
bootstrap() {
  local release=$1 tree=$2 mirror said
  local -a what=(--variant=minbase --include=ca-certificates,git)
  command -v debootstrap >/dev/null ||
    { vi_apt update && vi_apt install -y debootstrap debian-archive-keyring; } >/dev/null
  if ! command -v debootstrap >/dev/null; then
    why="debootstrap cannot be installed"
    return 1
  fi
  mirror=$(apt-get indextargets --format '$(REPO_URI)' \
    'Created-By: Packages' 'Origin: Debian' 'Label: Debian' | head -n 1)
  if [ -z "$mirror" ]; then
    why="the apt sources name no Debian mirror"
    return 1
  fi
  echo "vi_contact: building a tree of Debian $release. This is done once."
  rm -rf --one-file-system "$tree"
  if ! said=$(
    timeout 600 debootstrap "${what[@]}" "$release" "$tree" "$mirror" 2>&1 </dev/null
  ); then
    why="debootstrap failed (offline?): $(tail -n 1 <<<"$said")"
    return 1
  fi
  # the proxies of this machine
  apt-config dump | grep -E '^Acquire::(https?::|Check-)' >"$tree/etc/apt/apt.conf.d/99host"
  touch "$tree/complete"
}

# fill_tree FOLDER: this clone and the packages it asks for.
fill_tree() {
  local tree=$1 said
  local -a without=(--exclude=./.venv --exclude=./build --exclude=__pycache__)
  rm -rf --one-file-system "$tree/srv/vi_contact"
  mkdir -p "$tree/srv/vi_contact"
  tar -C "$root" "${without[@]}" -cf - . | tar -C "$tree/srv/vi_contact" --no-same-owner -xf -
  if ! said=$(in_tree "$tree" bash -c '. /srv/vi_contact/install/setup.sh; vi_setup' 2>&1); then
    why=$(tail -n 1 <<<"$said")
    return 1
  fi
}

# in_tree FOLDER bash -c "$as_user" - COMMAND…: as an ordinary user, who does not own the clone.
as_user='id vi >/dev/null 2>&1 || useradd -m vi; exec runuser -u vi -- env HOME=~vi "$@"'

# in_tree FOLDER COMMAND…: in namespaces of its own, so that its mounts and its processes end with
# it, however it ends. The time it may take is what is left of the budget.
in_tree() {
  local tree=$1
  shift
  timeout -k 10 "$(left)" unshare --mount --pid --fork --kill-child bash -c '
    mount -t proc proc "$0/proc" && mount --rbind /dev "$0/dev" && mount --rbind /sys "$0/sys" ||
      exit
    if ! mountpoint -q "$0/dev/shm"; then
      mkdir -p "$0/dev/shm" && mount -t tmpfs tmpfs "$0/dev/shm"
    fi

    # Its own null: where root made that of the machine unwritable for others, an ordinary user
    # could start nothing.
    null=$0/run/null
    if [ -c "$null" ] || mknod -m 666 "$null" c 1 3 2>/dev/null; then
      mount --bind "$null" "$0/dev/null"
    fi
    home="PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 CI=true"
    exec chroot "$0" env -i $home "$@"' "$tree" "$@" </dev/null
}
