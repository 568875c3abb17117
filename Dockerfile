# Farsteer in a container; tools/check-dockerfile runs these steps without Docker, in a bare Debian root.
#   docker build -t farsteer .
#   docker run --rm -v "$PWD/runs:/farsteer/runs" farsteer              # a drive, its files in runs/
#   docker run --rm -p 127.0.0.1:9090:9090 farsteer farsteer serve --host 0.0.0.0   # http://127.0.0.1:9090/

FROM debian:bookworm-slim AS system
RUN apt-get update \
    && apt-get install -y --no-install-recommends ca-certificates make python3 python3-venv \
    && rm -rf /var/lib/apt/lists/*

# What tests need of Debian; the devcontainer is this stage, with a clone of yours in it.
FROM system AS dev
COPY tools/test-setup /usr/local/bin/
RUN apt-get update \
    && apt-get install -y --no-install-recommends git \
    && test-setup \
    && rm -rf /var/lib/apt/lists/*

# The stage that is built unless another is named.
FROM system AS run
WORKDIR /farsteer
COPY . .
RUN make env
ENV PATH=/farsteer/.venv/bin:$PATH
EXPOSE 9090
CMD ["farsteer", "sim"]
