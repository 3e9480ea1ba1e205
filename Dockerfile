# The trainer in a container, and an engine that serves a built-in world. Linted here (tools/hosting.sh), and its list of libraries is tested
# against the program; but it has not been built: no Docker is at hand where this is written.
#
#   docker build -t consac --build-arg COMMIT="$(git rev-parse --short=12 HEAD)" .
#   docker run --rm -v "$PWD/runs:/runs" consac train cartpole-v1 --steps 100000
#   docker build -t consac-engine --target engine . && docker run --rm -p 5005:5005 -e CONSAC_TOKEN=secret consac-engine
#
# The user inside has number 10001; a folder that is mounted over /runs must let it write (chown 10001 runs).
FROM debian:12-slim AS build
WORKDIR /consac
COPY tools/setup.sh tools/cross_libraries.sh tools/
RUN tools/setup.sh build
COPY . .
ARG COMMIT=unknown
RUN cmake --preset release -DCONSAC_BUILD_TESTS=OFF -DCONSAC_BUILD_BENCH=OFF -DCONSAC_BUILD_GODOT=OFF -DCONSAC_BUILD_CAD=OFF --log-level=WARNING \
    && CONSAC_COMMIT="$COMMIT" cmake --build --preset release -j "$(nproc)" --target consac \
    && strip build/release/cli/consac

FROM debian:12-slim AS program
# Whatever of Debian 12 is newest is wanted: a version that is pinned is gone from the archive with the next correction.
# hadolint ignore=DL3008
RUN apt-get update \
    && apt-get install -y --no-install-recommends fonts-dejavu-core libcairo2 libfmt9 libhwy1 libpugixml1v5 libyaml-cpp0.7 \
    && rm -rf /var/lib/apt/lists/* \
    && useradd --uid 10001 --no-create-home consac \
    && install -d -o consac /runs
COPY --from=build /consac/build/release/cli/consac /usr/local/bin/consac
COPY LICENSE /usr/local/share/doc/consac/
# A run is below ./runs of where the program is called.
WORKDIR /
USER 10001
ENTRYPOINT ["consac"]

# An engine listens, so that it can be asked whether it does; the trainer is done when it is done.
FROM program AS engine
EXPOSE 5005
HEALTHCHECK --interval=30s --timeout=3s CMD ["bash", "-c", "exec 3<>/dev/tcp/127.0.0.1/5005"]
CMD ["serve", "road-v0", "--host", "0.0.0.0", "--port", "5005"]

FROM program AS trainer
VOLUME /runs
CMD ["--help"]
