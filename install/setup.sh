# Shared by demos/run.sh, tests/run.sh and .ci/run, which source it: clean environment, Debian's
# packages, MPI settings. It prints nothing unless it installs something or fails.

vi_root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
vi_python=/usr/bin/python3
# Another interpreter has its own DOLFINx: nothing is installed then.
if [ -n "${VI_CONTACT_PYTHON:-}" ]; then
  vi_python=$(realpath -s "$VI_CONTACT_PYTHON")
fi

vi_fail() {
  echo "vi_contact: $*" >&2
  exit 1
}

# Debian's interpreter, compiler and mpirun, whatever another Python distribution has put into the
# environment.
vi_clean_environment() {
  unset PYTHONHOME PYTHONSTARTUP PYTHONPLATLIBDIR VIRTUAL_ENV CONDA_PREFIX
  unset PETSC_ARCH PETSC_DIR SLEPC_DIR
  export PYTHONPATH=$vi_root PYTHONNOUSERSITE=1
  export PATH=/usr/sbin:/usr/bin:/sbin:/bin:$PATH
  # with the mpirun of its own MPI
  if [ -n "${VI_CONTACT_PYTHON:-}" ]; then
    export PATH=$(dirname "$vi_python"):$PATH
  fi
}

# One thread a rank. Open MPI 4 (Debian 12), 5 (Debian 13) and 6 (sid) on one machine: as root, with
# more ranks than cores, without noise.
vi_mpi_environment() {
  export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1 BLIS_NUM_THREADS=1
  export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
  export OMPI_MCA_rmaps_base_oversubscribe=1 OMPI_MCA_hwloc_base_binding_policy=none
  # 5 does not know the new names, and 6 prints 16 lines about the old ones
  case $(mpirun --version 2>/dev/null) in
    *"(Open MPI) 5."*)
      export PRTE_MCA_rmaps_default_mapping_policy=:oversubscribe
      export PRTE_MCA_hwloc_default_binding_policy=none
      ;;
    *) export PRTE_MCA_mapby=:oversubscribe PRTE_MCA_bindto=none ;;
  esac
  # one rank without mpirun: no daemon to start, none to fail
  export OMPI_MCA_ess_singleton_isolated=1
  export HWLOC_HIDE_ERRORS=2 UCX_LOG_LEVEL=fatal
  export OMPI_MCA_pml=ob1 OMPI_MCA_btl=^tcp,openib,ofi,uct,usnic
  export OMPI_MCA_btl_vader_single_copy_mechanism=none
}

# Several ranks give their cores away while they wait for each other. One rank must not: MUMPS asks
# MPI a hundred thousand times in a small run, and beside other work each answer would cost it its
# turn: minutes in the place of seconds.
vi_ranks=(env OMPI_MCA_mpi_yield_when_idle=1 mpirun -n)

# dolfinx keeps compiled forms, and matplotlib its fonts, under ~/.cache: elsewhere when there is no
# such place.
vi_cache_environment() {
  local cache=${XDG_CACHE_HOME:-${HOME:+$HOME/.cache}}
  if [ -z "$cache" ] || ! mkdir -p "$cache/fenics" 2>/dev/null || ! [ -w "$cache/fenics" ]; then
    cache=${TMPDIR:-/tmp}/vi_contact-cache-$(id -u)
    mkdir -p "$cache/fenics" || vi_fail "no writable cache directory: set XDG_CACHE_HOME to one"
  fi
  export XDG_CACHE_HOME=$cache
  # what a compilation that was killed has left: dolfinx would wait for its end
  find "$cache/fenics" -name '*.c' -mmin +2 | while read -r form; do
    [ -e "$form.cached" ] || rm -f "$form"
  done
  if [ -z "${HOME:-}" ] || [ ! -w "$HOME" ]; then
    export HOME=$cache
  fi
}

# The build with real numbers, also where the complex one is installed and preferred.
vi_choose_real_petsc() {
  [ ! -d /usr/lib/petscdir/petsc-real ] || export PETSC_DIR=/usr/lib/petscdir/petsc-real
}

# The listed packages that are not installed, on one line. (No <(…): that needs /proc, which a bare
# tree may lack.)
vi_missing_packages() {
  local wanted installed package missing=()
  wanted=$(grep -v '^#' "$vi_root/install/debian-packages.txt")
  installed=$(dpkg-query -W -f '=${db:Status-Status} ${Package}=\n' $wanted 2>/dev/null)
  for package in $wanted; do
    case $installed in
      *"=installed $package="*) ;;
      *) missing+=("$package") ;;
    esac
  done
  echo "${missing[*]}"
}

# apt-get, as root or through sudo; what it says goes to standard output.
vi_apt() {
  local become=()
  [ "$(id -u)" -eq 0 ] || become=(sudo)
  "${become[@]}" env LC_ALL=C DEBIAN_FRONTEND=noninteractive \
    apt-get -q -o DPkg::Lock::Timeout=300 -o Acquire::Retries=3 "$@" 2>&1 </dev/null
}

# Whether packages can be installed: as root, or through a sudo that asks nothing, or that somebody
# can answer.
vi_may_install() {
  [ "$(id -u)" -eq 0 ] || sudo -n true 2>/dev/null || { command -v sudo >/dev/null && [ -t 0 ]; }
}

# Installs the listed packages that are missing.
vi_install_packages() {
  local missing said count why
  missing=$(vi_missing_packages)
  [ -n "$missing" ] || return 0
  command -v apt-get >/dev/null || vi_fail "needs Debian (there is no apt-get here) with $missing"
  vi_may_install ||
    vi_fail "packages are missing and sudo cannot be used; as root:" \
      "apt-get install --no-install-recommends $missing"
  count=$(wc -w <<<"$missing")
  echo "vi_contact: installing $count Debian packages and what they need." \
    "It takes some minutes, once." >&2

  # Its status tells nothing: a broken third-party source fails it, and being offline does not.
  said=$(vi_apt update)
  grep -qE '^(Hit|Get):' <<<"$said" ||
    vi_fail "offline: no Debian mirror answers; missing: $missing"
  said=$(vi_apt install -y --no-install-recommends $missing)
  missing=$(vi_missing_packages)
  if [ -n "$missing" ]; then
    why=$(grep -m1 '^E:' <<<"$said" || tail -n 1 <<<"$said")
    vi_fail "could not install $missing: $why"
  fi
}

# Everything that the project's scripts need.
vi_setup() {
  vi_clean_environment
  if [ -z "${VI_CONTACT_PYTHON:-}" ]; then
    vi_install_packages
    vi_choose_real_petsc
  fi
  vi_mpi_environment
  vi_cache_environment
}
