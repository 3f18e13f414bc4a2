# The service and its programs in a container, from the Debian package:
#   docker build -t bodyschema .
#   docker run --rm --network host bodyschema bodyschemad --config config/icub_right/estimator.yaml --page 8080
# LCM is UDP multicast: containers that share the host's network hear it.
FROM debian:12 AS build
COPY . /bodyschema
WORKDIR /bodyschema
RUN scripts/setup
RUN cmake --preset release -DBODYSCHEMA_BUILD_TESTS=OFF -DBODYSCHEMA_BUILD_BENCH=OFF && \
    cmake --build --preset release && \
    cpack --config build/release/CPackConfig.cmake -B /package

FROM debian:12
COPY --from=build /package/bodyschema_*.deb /tmp/
RUN apt-get update && apt-get install -y --no-install-recommends /tmp/bodyschema_*.deb && \
    rm -rf /tmp/bodyschema_*.deb /var/lib/apt/lists/*
CMD ["bodyschemad", "--help"]
