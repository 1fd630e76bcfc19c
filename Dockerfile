# docker build -t poolcal .    The same set-up as on any machine; runs as a user without rights of its own.
FROM python:3.12-slim-bookworm
# pango and the fonts: poolcal report --pdf, also of names in Chinese
RUN apt-get update && \
    apt-get install -y --no-install-recommends make libpango-1.0-0 libpangoft2-1.0-0 fonts-dejavu-core fonts-wqy-microhei && \
    rm -rf /var/lib/apt/lists/*
WORKDIR /opt/poolcal
COPY pyproject.toml constraints.txt Makefile README.md ./
COPY tools/setup.sh tools/
COPY configs configs
COPY pipeline pipeline
COPY stages stages
# The folder of compiled loops can be written by any user: where it cannot, each call would compile them again.
RUN make setup EXTRAS=pdf && rm -rf /root/.cache /var/lib/apt/lists/* && chmod -R a+rX /opt/poolcal && \
    chmod -R a+rwX pipeline/maths/kernels/__pycache__
RUN useradd --uid 1000 poolcal
USER poolcal
# any user that docker run --user names has a folder for caches
ENV HOME=/tmp
WORKDIR /data
ENTRYPOINT ["/opt/poolcal/.venv/bin/poolcal"]
