# The app in a container. Build it, then start it for the browsers of this computer only:
#
#   docker build -t packetmesh .
#   docker run --rm -p 127.0.0.1:8080:8080 packetmesh
#
# The server prints a link that ends in ?token=... and lets in only browsers that open it. The address in that
# link is the container's own: open the same link with 127.0.0.1 in its place. The connection is not encrypted.
FROM python:3.12-slim

ENV PIP_NO_CACHE_DIR=1 \
    PIP_DISABLE_PIP_VERSION_CHECK=1 \
    PIP_ROOT_USER_ACTION=ignore

# Open3D needs these.
RUN apt-get update -qq \
    && apt-get install -qq --no-install-recommends libgl1 libegl1 libx11-6 libidn2-0 libudev1 libgomp1 \
    && rm -rf /var/lib/apt/lists/*

WORKDIR /build
COPY requirements.lock ./
RUN pip install --require-hashes -r requirements.lock

COPY pyproject.toml README.md LICENSE ./
COPY packetmesh packetmesh
COPY network_sim network_sim
COPY pipeline pipeline
COPY lab lab
COPY assets assets
COPY app app
RUN pip install --no-deps --no-build-isolation . && rm -rf build ./*.egg-info

RUN useradd --create-home packetmesh
USER packetmesh
WORKDIR /home/packetmesh
ENV NUMBA_CACHE_DIR=/home/packetmesh/.cache/numba
# Compile now, not at the first use.
RUN python -m app.compute.warm

EXPOSE 8080
ENTRYPOINT ["packetmesh"]
CMD ["serve", "--host", "0.0.0.0", "--port", "8080"]
