# docker build -t poolcal .    The same set-up as on any machine; runs as a user without rights of its own.
FROM python:3.12-slim-bookworm
RUN apt-get update && apt-get install -y --no-install-recommends make git && rm -rf /var/lib/apt/lists/*
WORKDIR /opt/poolcal
COPY pyproject.toml constraints.txt Makefile README.md ./
COPY tools/setup.sh tools/
COPY configs configs
COPY pipeline pipeline
COPY stages stages
RUN make setup EXTRAS= && rm -rf /root/.cache /var/lib/apt/lists/* && chmod -R a+rX /opt/poolcal
RUN useradd --create-home --uid 1000 poolcal
USER poolcal
WORKDIR /data
ENTRYPOINT ["/opt/poolcal/.venv/bin/poolcal"]
