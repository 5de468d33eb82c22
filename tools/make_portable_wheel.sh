#!/bin/sh
# Build a wheel for any Linux with a C library of 2018 or later (manylinux_2_28) on a newer Debian, without
# a container: build/dist. At first this takes a quarter of an hour; HDF5 and FFTW are kept in build/portable.
#
# A program asks for the versions of the symbols that the linker saw. The compiler is therefore pointed at
# stubs of an old C library, which PyPI's package ziglang generates: they hold the names and versions of
# its symbols. The libraries of GCC are those of PyPI's packages fpm and scikit-learn, which were built on
# such systems; what that libgfortran lacks, as findloc of texts, is an error of the linker. FFTW and HDF5 are
# built from Debian's sources, or from the archives in the folder $ASPERITY_SOURCES.
set -eu
cd "$(dirname "$0")/.."
. tools/setup.sh
. tools/setup_wheel.sh
glibc=2.28
folder=$PWD/build/portable
stubs=$folder/stubs
prefix=$folder/prefix

# Link a small program for the old C library, and keep the stubs that are made for that.
make_stubs() {
  rm -rf "$stubs" "$folder/zig"
  mkdir -p "$stubs" "$folder/zig"
  echo 'int main(void) { return 0; }' >"$folder/zig/empty.c"
  ZIG_GLOBAL_CACHE_DIR=$folder/zig/cache python -m ziglang cc -target "x86_64-linux-gnu.$glibc" \
    -pie -fPIE "$folder/zig/empty.c" -o "$folder/zig/empty" -lm
  find "$folder/zig/cache" \( -name 'lib*.so.*' -o -name Scrt1.o -o -name libc_nonshared.a \) \
    -exec cp {} "$stubs/" \;
  rm -rf "$folder/zig"

  for name in m pthread dl rt util resolv; do
    ln -s "$(basename "$stubs"/lib$name.so.*)" "$stubs/lib$name.so"
  done
  mv "$stubs/libld.so.2" "$stubs/ld-linux-x86-64.so.2"
  echo "GROUP ( $stubs/libc.so.6 $stubs/libc_nonshared.a" \
    "AS_NEEDED ( $stubs/ld-linux-x86-64.so.2 ) )" >"$stubs/libc.so"

  # The compiler reads this file before each source; that of the system offers functions for vectors. The folder
  # stands for the compiler's own, whose modules it therefore needs, too.
  cp -r "$(gfortran -print-file-name=finclude)" "$stubs/finclude"
  echo '! The old C library has no functions for vectors that Fortran calls.' \
    >"$stubs/finclude/math-vector-fortran.h"
}

# Copy the libraries of GCC from the wheels that carry them, and give them their usual names again.
copy_runtime() {
  rm -rf "$folder/wheels"
  python -m pip download -q --disable-pip-version-check --no-deps -d "$folder/wheels" \
    fpm==0.12.0 scikit-learn==1.9.1
  for wheel in "$folder"/wheels/*.whl; do
    python -m zipfile -e "$wheel" "$folder/wheels"
  done
  mkdir -p "$prefix/lib/pkgconfig" "$prefix/share/licenses/gcc-runtime"
  for library in fpm.libs/libquadmath.so.0 fpm.libs/libgfortran.so.5 scikit_learn.libs/libgomp.so.1; do
    soname=${library##*/}
    name=${soname%%.so*}
    cp "$folder/wheels/${library%/*}/$name"-*.so.* "$prefix/lib/$soname"
    patchelf --set-soname "$soname" "$prefix/lib/$soname"
    ln -sf "$soname" "$prefix/lib/$name.so"
  done
  hashed=$(basename "$folder"/wheels/fpm.libs/libquadmath-*)
  patchelf --replace-needed "$hashed" libquadmath.so.0 "$prefix/lib/libgfortran.so.5"
  rm -rf "$folder/wheels"

  # This libgfortran is older than the compiler, and lacks the report of a failed `allocate`.
  cat >"$folder/newer.c" <<'END'
#include <stdarg.h>
#include <stdio.h>
void _gfortran_os_error(const char *);
void _gfortran_os_error_at(const char *where, const char *format, ...)
{
  char text[512];
  int length = snprintf(text, sizeof text, "%s: ", where);
  va_list words;
  va_start(words, format);
  vsnprintf(text + length, length < 500 ? sizeof text - length : 0, format, words);
  va_end(words);
  _gfortran_os_error(text);
}
END
  gcc -O2 -fPIC -B"$stubs/" -c "$folder/newer.c" -o "$folder/newer.o"
  ar rc "$prefix/lib/libgfortran_newer.a" "$folder/newer.o"
  rm "$prefix/lib/libgfortran.so" "$folder/newer.c" "$folder/newer.o"
  echo "INPUT ( $prefix/lib/libgfortran.so.5 $prefix/lib/libgfortran_newer.a )" >"$prefix/lib/libgfortran.so"

  cp /usr/share/doc/libgcc-s1/copyright "$prefix/share/licenses/gcc-runtime/"
  printf '%s\n' 'Name: gcc-runtime' 'Description: libgfortran, libquadmath and libgomp of GCC' \
    "Version: as-in-fpm-0.12.0-and-scikit-learn-1.9.1" >"$prefix/lib/pkgconfig/gcc-runtime.pc"
}

# Download the sources of Debian's packages, with lists of our own: those of the system stay as they are.
fetch_sources() {
  lists=$folder/apt
  mkdir -p "$lists/parts" "$lists/lists/partial" "$lists/cache/archives/partial" "$folder/sources"
  if [ -e /etc/apt/sources.list.d/debian.sources ]; then
    sed 's/^Types:.*/Types: deb-src/' /etc/apt/sources.list.d/debian.sources >"$lists/parts/debian.sources"
  else
    sed -n 's/^deb /deb-src /p' /etc/apt/sources.list >"$lists/parts/debian.list"
  fi
  set -- -qq -o APT::Sandbox::User=root -o "Dir::Etc::SourceList=/dev/null" -o "Dir::Etc::SourceParts=$lists/parts" \
    -o "Dir::State::Lists=$lists/lists" -o "Dir::Cache=$lists/cache"
  apt-get "$@" update
  (cd "$folder/sources" && apt-get "$@" source --download-only hdf5 fftw3)
  rm -rf "$lists"
}

mkdir -p "$folder"
make_stubs
copy_runtime
if ! [ "$folder/ready" -nt tools/build_libraries.sh ]; then
  echo "asperity: building HDF5 and FFTW for an old C library in build/portable" >&2
  if [ -z "${ASPERITY_SOURCES:-}" ]; then
    fetch_sources
    ASPERITY_SOURCES=$folder/sources
    export ASPERITY_SOURCES
  fi
  # A symbol that the old C library lacks is an error here, where it would else be one for the user.
  CC="gcc -B$stubs/" LDFLAGS=-Wl,-z,defs sh tools/build_libraries.sh "$prefix"
  touch "$folder/ready"
fi

# The stubs come before the compiler's own folders, however the linker is called.
ln -sf "$prefix/lib/libgfortran.so" "$prefix/lib/libgomp.so" "$prefix/lib/libquadmath.so" "$stubs/"

# Libraries of the system may ask for more than the stubs have: libgcc_s, which no wheel carries, does.
CC="gcc -B$stubs/" FC="gfortran -B$stubs/" LDFLAGS="-L$prefix/lib -Wl,--allow-shlib-undefined" \
  ASPERITY_LIBRARIES=$prefix AUDITWHEEL_PLAT=manylinux_$(echo $glibc | tr . _)_x86_64 sh tools/make_wheel.sh
