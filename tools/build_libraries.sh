#!/bin/sh
# Build the libraries that a wheel carries, with nothing that Asperity does not use:
#
#     tools/build_libraries.sh PREFIX [hdf5] [fftw]       both, where none is named
#
# HDF5 is the C library alone, with zlib: without the drivers for the network (curl, Kerberos, LDAP), the
# high-level library, szip, and the interfaces for other languages. FFTW is built for double and single
# precision. The source archives are taken from the folder $ASPERITY_SOURCES, where they are
# there (hdf5*.tar.gz, fftw*.tar.gz), and else from their projects' sites. Licences are left in
# PREFIX/share/licenses. The build of Asperity finds the libraries by
#
#     PKG_CONFIG_PATH=PREFIX/lib/pkgconfig
set -eu
prefix=$1
shift
wanted=${*:-hdf5 fftw}
hdf5_url=https://github.com/HDFGroup/hdf5/releases/download/hdf5_1.14.6/hdf5-1.14.6.tar.gz
fftw_url=https://www.fftw.org/fftw-3.3.10.tar.gz
jobs=${JOBS:-$(nproc)}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# Unpack the sources of a library into $work/NAME.
unpack() {
  name=$1
  archive=$(ls "${ASPERITY_SOURCES:-/nowhere}/$name"*.tar.gz 2>/dev/null | head -1 || true)
  if [ -z "$archive" ]; then
    archive=$work/$name.tar.gz
    echo "asperity: downloading $2" >&2
    curl -fsSL --retry 3 -o "$archive" "$2"
  fi
  mkdir -p "$work/$name"
  tar xf "$archive" -C "$work/$name" --strip-components=1
}

# Keep the licence of a library.
keep_licence() {
  mkdir -p "$prefix/share/licenses/$1"
  cp "$2" "$prefix/share/licenses/$1/"
}

build_hdf5() {
  unpack hdf5 "$hdf5_url"
  cd "$work/hdf5"
  ./configure --prefix="$prefix" --libdir="$prefix/lib" --enable-build-mode=production --disable-static \
    --disable-tests --disable-tools --disable-hl --disable-cxx --disable-fortran --disable-java \
    --disable-ros3-vfd --without-szlib --with-zlib >configure.log
  make -s -j "$jobs" -C src >make.log 2>&1 || { tail -20 make.log; exit 1; }
  make -s -C src install >>make.log 2>&1 || { tail -20 make.log; exit 1; }
  keep_licence hdf5 COPYING
  version=$(sed -n 's/^#define H5_VERS_INFO *"HDF5 library version: \([0-9.]*\).*/\1/p' src/H5public.h)
  mkdir -p "$prefix/lib/pkgconfig"
  cat >"$prefix/lib/pkgconfig/hdf5.pc" <<END
prefix=$prefix
Name: hdf5
Description: HDF5, the C library alone
Version: $version
Libs: -L\${prefix}/lib -lhdf5
Cflags: -I\${prefix}/include
END
  # Where Debian's HDF5 is installed, too, the build of Asperity looks for its name first.
  cp "$prefix/lib/pkgconfig/hdf5.pc" "$prefix/lib/pkgconfig/hdf5-serial.pc"
}

build_fftw() {
  unpack fftw "$fftw_url"
  for kind in double float; do
    single=
    [ $kind = double ] || single=--enable-float
    mkdir -p "$work/fftw-$kind"
    cd "$work/fftw-$kind"
    ../fftw/configure --prefix="$prefix" --libdir="$prefix/lib" --enable-shared --disable-static \
      --disable-fortran --disable-doc --enable-sse2 --enable-avx --enable-avx2 \
      $single >configure.log
    make -s -j "$jobs" >make.log 2>&1 || { tail -20 make.log; exit 1; }
    make -s install >>make.log 2>&1 || { tail -20 make.log; exit 1; }
  done
  keep_licence fftw3 "$work/fftw/COPYING"
}

mkdir -p "$prefix"
prefix=$(cd "$prefix" && pwd)
for library in $wanted; do
  case $library in
    hdf5) build_hdf5 ;;
    fftw) build_fftw ;;
    *) echo "build_libraries.sh: no library is named $library: there are hdf5, fftw" >&2; exit 2 ;;
  esac
done
