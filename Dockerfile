# fem_seal on Debian 13, installed as `make setup` does:
#   docker build -t fem_seal .
#   docker run --rm -v "$PWD:/scenes" fem_seal run SCENE.toml
FROM debian:trixie-slim
COPY . /fem_seal
RUN /fem_seal/setup.sh && rm -rf /var/lib/apt/lists/* /root/.cache
ENV PATH=/fem_seal/.venv/bin:$PATH
WORKDIR /scenes
ENTRYPOINT ["fem-seal"]
